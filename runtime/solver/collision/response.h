// The velocity after a contact: restitution and Coulomb friction.
#pragma once

#include "runtime/vec.h"

namespace rapid {

// Given the velocities of the point (v) and of the surface (vc) where they touch, m/s, and the unit normal n out of the
// surface. Paper eq. (4), which is frictionless; friction = 0 gives it. bounce (ε) in [0, 1], friction (μ) >= 0. The
// velocity of a separating pair is returned unchanged.
//
// In double: in single precision a point that bounces for ever drifts in speed.
Vec3d contact_response(const Vec3d& v, const Vec3d& vc, const Vec3d& n, double bounce, double friction);

}  // namespace rapid
