// State of points held by a shape, stored between frames. These columns belong to the state and are not written to
// outputs.
//
//   stuckto      the obstacle's key; negative if the point was torn off and still touches it; 0: none
//   stuckface    face of the surface point that holds it (MaterialPoint); `sliding` if it slides along the surface
//   stuckat      position of that surface point: in the body's frame or over the face, without the point's radius
//   stuckP       position after the last step: a point found elsewhere was moved by a script
#pragma once

#include <cstdint>
#include <span>

#include "runtime/points/point_set.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

class StuckColumns {
public:
    static constexpr const char* names[] = {"stuckP", "stuckat", "stuckface", "stuckto"};
    static constexpr std::int32_t sliding = -2;

    // Returns true if a collider holds points.
    static bool are_needed(const Dynamics& dynamics);
    // add_to() creates the missing columns; remove_from() removes them from the set.
    static void add_to(PointSet& points);
    static void remove_from(PointSet& points);

    // Makes the columns writable, on one thread. They must exist.
    explicit StuckColumns(PointSet& points);

    // By index in the set.
    std::span<std::int32_t> to, face;
    std::span<Vec3f> at, P;
};

}  // namespace rapid
