// The potential energy of springs to the surfaces of shapes, and how these move.
#pragma once

#include "runtime/solver/forces.h"

namespace rapid {

// J/kg, of a point at P: w2 φ²/2, with the distance φ of the shape at the spring's time, as far as its gradient tells
// it.
double potential_energy(const SurfaceSpring& spring, const Vec3d& P);
// m/s: of the shape at P, so many seconds before the spring's time.
Vec3d velocity_of_surface(const SurfaceSpring& spring, const Vec3d& P, double before);

}  // namespace rapid
