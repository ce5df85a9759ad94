// What a point that a shape holds knows of it from frame to frame. Columns of the state, which outputs do not have.
//
//   stuckto      the obstacle's key; negative where the point has been torn off and still touches it; 0: none
//   stuckface    of the surface's point that it is stuck to (MaterialPoint); `sliding` where it slides along the
//   surface stuckat      the same: in the body's frame, or over the face, without the point's radius stuckP       where
//   the last step left it: a point that is elsewhere has been moved by a script
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

    // Whether a collider holds points.
    static bool are_needed(const Dynamics& dynamics);
    // Brings those into being that are missing; the set without them.
    static void add_to(PointSet& points);
    static void remove_from(PointSet& points);

    // Makes the columns writable, on one thread. They must exist.
    explicit StuckColumns(PointSet& points);

    // By index in the set.
    std::span<std::int32_t> to, face;
    std::span<Vec3f> at, P;
};

}  // namespace rapid
