// What a contact does to a velocity.
#pragma once

#include "runtime/vec.h"

namespace rapid {

// Velocity after a contact, given that of the point (v) and of the surface (vc) where they touch, m/s; n is the unit
// normal, out of the surface. Paper eq. (4), which is frictionless; friction = 0 gives it.
// bounce (ε) in [0, 1], friction (μ) >= 0. A separating pair is returned unchanged.
//
// In double: a point that bounces for ever drifts in speed otherwise.
Vec3d contact_response(const Vec3d& v, const Vec3d& vc, const Vec3d& n, double bounce, double friction);

}  // namespace rapid
