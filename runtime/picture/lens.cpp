#include "runtime/picture/lens.h"

#include <cmath>

namespace rapid {

Vec3f any_tangent(const Vec3f& n)
{
    const Vec3f axis = std::abs(n.y()) < 0.9f ? Vec3f::UnitY().eval() : Vec3f::UnitX().eval();
    return axis.cross(n).normalized();
}

Lens Lens::of_camera(const Camera& camera, int width, int height)
{
    Lens lens;
    lens.origin = camera.position.cast<float>();
    Vec3d forward = camera.target - camera.position;
    forward = forward.norm() > 0 ? forward.normalized().eval() : Vec3d(0, 0, -1);
    Vec3d right = forward.cross(Vec3d::UnitY());
    right = right.norm() > 1e-6 ? right.normalized().eval() : Vec3d::UnitX().eval();
    lens.forward = forward.cast<float>();
    lens.right = right.cast<float>();
    lens.up = right.cross(forward).cast<float>();
    lens.focal = static_cast<float>(0.5 * height / std::tan(0.5 * camera.fov));
    lens.center_x = 0.5f * static_cast<float>(width);
    lens.center_y = 0.5f * static_cast<float>(height);
    return lens;
}

Vec3d Camera::project(const Vec3d& P, int width, int height) const
{
    return Lens::of_camera(*this, width, height).project(P.cast<float>()).cast<double>();
}

}  // namespace rapid
