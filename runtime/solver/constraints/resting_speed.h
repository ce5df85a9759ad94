// Thresholds for resting contact.
#pragma once

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// Closing speed, m/s, below which a contact neither bounces nor wakes sleepers: twice the speed that accelerations
// give a point at rest in a substep.
inline double resting_speed(const Substep& step) { return 2.0 * step.max_acceleration * step.dt; }

// Distance below which points may come into contact in the projection, relative to the sum of their radii.
constexpr double near_contact = 1.02;

}  // namespace rapid
