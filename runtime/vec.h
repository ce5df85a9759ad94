// Vectors as the runtime holds them: packed x y z, single precision in columns, double inside a step.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <span>

namespace rapid {

using Vec3f = Eigen::Vector3f;
using Vec3d = Eigen::Vector3d;
using Quatf = Eigen::Quaternionf;

static_assert(sizeof(Vec3f) == 12 && sizeof(Vec3d) == 24 && sizeof(Quatf) == 16, "columns are packed");

// The coordinates of many vectors one after the other, as loops that the compiler makes vectors of want them.
template <class Vec3>
auto* coordinates(std::span<Vec3> x)
{
    return x.empty() ? nullptr : x.front().data();
}

// Shapes [n], [n]; to nearest.
inline void cast(std::span<const Vec3f> from, std::span<Vec3d> to)
{
    const float* x = coordinates(from);
    double* y = coordinates(to);
    for (std::size_t l = 0; l < 3 * from.size(); ++l) y[l] = x[l];
}
inline void cast(std::span<const Vec3d> from, std::span<Vec3f> to)
{
    const double* x = coordinates(from);
    float* y = coordinates(to);
    for (std::size_t l = 0; l < 3 * from.size(); ++l) y[l] = static_cast<float>(x[l]);
}

// An axis-aligned box; empty until something extends it. An unbounded shape has infinite corners.
using Box3f = Eigen::AlignedBox3f;
using Box3d = Eigen::AlignedBox3d;

}  // namespace rapid
