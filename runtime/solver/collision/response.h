// The velocity after a contact: restitution and Coulomb friction.
#pragma once

#include "runtime/math/vec.h"

namespace rapid {

// Returns the velocity after a contact, given the velocities of the point (v) and of the surface (vc) at the contact,
// m/s, and the unit normal n out of the surface. Paper eq. (4), which is frictionless, follows for friction = 0.
// bounce (ε) in [0, 1], friction (μ) >= 0. Separating pairs keep their velocity.
//
// Uses double precision, because in single precision the speed of a point that bounces forever drifts.
Vec3d contact_response(const Vec3d& v, const Vec3d& vc, const Vec3d& n, double bounce, double friction);

}  // namespace rapid
