// The hit attributes: the last contact of each point, using Houdini's names.
//
//   hittotal   contacts since birth          hitnum    contacts in this frame
//   hitpos     position, m                   hitnml    normal of the surface, unit
//   hitv       velocity of the surface, m/s  hittime   s since the start
//   hitimpulse mass times the velocity change, kg m/s
//   hitpath    index of the collider among those of the chain, from 0
#pragma once

#include <cstdint>
#include <span>

#include "runtime/points/point_set.h"

namespace rapid {

// A contact that changed the velocity of a point.
struct Impact {
    Vec3d P, n, vc;  // position, m; the surface's normal, unit, and velocity, m/s
    double speed;    // of approach, m/s
    Vec3d v;         // of the point before, m/s
    Vec3d change;    // of the velocity, m/s
    double time;     // s since the start
};

class Hits {
public:
    static constexpr const char* names[] = {"hitimpulse", "hitnml",  "hitnum",   "hitpath",
                                            "hitpos",     "hittime", "hittotal", "hitv"};

    // Makes the columns writable, on one thread. They must exist.
    Hits(PointSet& points, bool begins_frame);

    // Records a hit of the point at this index of the set; impulse: kg m/s.
    void record(std::size_t point, int collider, const Impact& impact, double impulse);

private:
    std::span<float> impulse_, time_;
    std::span<Vec3f> nml_, pos_, v_;
    std::span<std::int32_t> num_, path_, total_;
};

}  // namespace rapid
