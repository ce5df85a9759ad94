// The points that constraints act on, as the projection sees them.
#pragma once

#include <cstdint>

#include "runtime/vec.h"

namespace rapid {

// A position, m, and an inverse mass, 1/kg: 0 of a point that no constraint moves, or that sleeps. A cache line holds
// two.
struct alignas(32) ProjectedPoint {
    Vec3d P;
    double w;
};

// A point's motion in a sub-step since its last impact; kept where something bounces (impact.h).
struct FreePath {
    Vec3d acceleration;       // m/s², of the point
    Vec3d reaction;           // m/s², the part of it by the shape on which the point lies
    double since = 0;         // s, until the end of the sub-step; the whole of it where there was no impact
    std::uint32_t sweep = 0;  // in which the impact was solved, from 1; 0 for none
};

// What a constant acceleration of 1 m/s² does to a point in a sub-step: to its velocity, m/s, and to its position, m:
// dt and dt²/2, but for drag and springs. And what draws the point, at P, m/s²: pull - stiffness P.
struct Mobility {
    double v, x;
    Vec3d pull = Vec3d::Zero();
    double stiffness = 0;  // 1/s²
};

}  // namespace rapid
