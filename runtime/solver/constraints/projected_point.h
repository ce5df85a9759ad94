// The representation of points in the projection.
#pragma once

#include <cstdint>

#include "runtime/math/vec.h"

namespace rapid {

// A position, m, and an inverse mass, 1/kg: 0 for a point that no constraint moves, or that sleeps. A cache line holds
// two.
struct alignas(32) ProjectedPoint {
    Vec3d P;
    double w;
};

// A point's motion in a substep since its last impact; used if something bounces (impact.h).
struct FreePath {
    Vec3d acceleration;       // m/s², of the point
    Vec3d reaction;           // m/s², the part of it due to the shape that supports the point
    double since = 0;         // s, until the end of the substep; the whole substep without an impact
    std::uint32_t sweep = 0;  // the sweep that solved the impact, from 1; 0 for none
};

// The changes in velocity, m/s, and position, m, due to a constant acceleration of 1 m/s² over a substep: dt and dt²/2
// without drag and springs. The force on the point at P, m/s², is pull - stiffness P.
struct Mobility {
    double v, x;
    Vec3d pull = Vec3d::Zero();
    double stiffness = 0;  // 1/s²
};

}  // namespace rapid
