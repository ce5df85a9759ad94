#include "runtime/solver/surface_potential.h"

#include "runtime/shapes/shape.h"

namespace rapid {

double potential_energy(const SurfaceSpring& spring, const Vec3d& P)
{
    double phi = 0;
    Vec3d gradient = Vec3d::Zero();
    spring.shape->distance({&P, 1}, {&phi, 1}, {&gradient, 1});
    const double slope2 = gradient.squaredNorm();
    return slope2 > 0 ? 0.5 * spring.w2 * phi * phi / slope2 : 0;
}

}  // namespace rapid
