#include "runtime/solver/surface_potential.h"

#include <cmath>

#include "runtime/shapes/shape.h"

namespace rapid {

double potential_energy(const SurfaceSpring& spring, const Vec3d& P)
{
    double phi = 0;
    Vec3d gradient = Vec3d::Zero();
    spring.shape->distance_at({&P, 1}, {&spring.time, 1}, {&phi, 1}, {&gradient, 1});
    const double slope2 = gradient.squaredNorm();
    if (slope2 > 0) return 0.5 * spring.w2 * phi * phi / slope2;
    return std::isinf(spring.shape->band()) ? 0.5 * spring.w2 * phi * phi : 0;
}

Vec3d velocity_of_surface(const SurfaceSpring& spring, const Vec3d& P, double before)
{
    return spring.shape->moves() ? spring.shape->velocity_at(P, spring.time - before) : Vec3d(Vec3d::Zero());
}

}  // namespace rapid
