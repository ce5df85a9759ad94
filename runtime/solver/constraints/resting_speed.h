// What counts as resting contact.
#pragma once

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// m/s, closing: a slower contact does not bounce, nor wake sleepers. Twice what the accelerations give a point at rest
// in a sub-step.
inline double resting_speed(const Substep& step) { return 2.0 * step.max_acceleration * step.dt; }

// Points that are as near as this, in parts of the sum of their radii, may come to touch in the projection.
constexpr double near_contact = 1.02;

}  // namespace rapid
