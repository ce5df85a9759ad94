// The hit attributes: the last contact of each point, by Houdini's names.
//
//   hittotal   contacts since birth          hitnum    contacts in this frame
//   hitpos     where, m                      hitnml    normal of the surface, unit
//   hitv       velocity of the surface, m/s  hittime   s since the start
//   hitimpulse mass times the change of velocity, kg m/s
//   hitpath    place of the collider among those of the chain, from 0
#pragma once

#include <cstdint>
#include <span>

#include "runtime/points/point_set.h"

namespace rapid {

class Hits {
public:
    static constexpr const char* names[] = {"hitimpulse", "hitnml",  "hitnum",   "hitpath",
                                            "hitpos",     "hittime", "hittotal", "hitv"};

    // Makes the columns writable, on one thread. They must exist.
    Hits(PointSet& points, bool begins_frame);

    void record(std::size_t i, const Vec3d& P, const Vec3d& n, const Vec3d& vc, double time, double impulse,
                int collider);

private:
    std::span<float> impulse_, time_;
    std::span<Vec3f> nml_, pos_, v_;
    std::span<std::int32_t> num_, path_, total_;
};

}  // namespace rapid
