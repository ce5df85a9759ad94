// Motion under quadratic drag, linear drag and a constant acceleration together:
//
//   v' = G - (k + c |v|) v
//
// Along one line this is Riccati's equation, which has a closed form; across the line the drag is linear, with a
// time-dependent rate from that closed form. A point that only drag slows, or that falls along its velocity, therefore
// moves exactly, for any c v t; all others do to second order.
#pragma once

#include "runtime/solver/motion/damped_motion.h"

namespace rapid {

// Returns the response of a point with the velocity v (m/s) and the acceleration at rest G (m/s²); k: 1/s, at least 0;
// c: 1/m, above 0; t: s. The velocity across the motion decays as e^(-rate t).
Dragged respond_to_quadratic_drag(const Vec3d& v, const Vec3d& G, double k, double c, double t);

}  // namespace rapid
