// Vectors of the runtime: packed x y z, single precision in columns, double precision inside a step.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace rapid {

using Vec3f = Eigen::Vector3f;
using Vec3d = Eigen::Vector3d;
using Quatf = Eigen::Quaternionf;

static_assert(sizeof(Vec3f) == 12 && sizeof(Vec3d) == 24 && sizeof(Quatf) == 16, "columns are packed");

// Returns the coordinates of many vectors as one contiguous array, so that the compiler can vectorise loops.
template <class Vec3>
auto* coordinates(std::span<Vec3> x)
{
    return x.empty() ? nullptr : x.front().data();
}

// Converts with rounding to nearest. Shapes [n], [n].
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

// Returns |x| as bits, which have the same order. Infinity and NaN give at least `infinity_bits`, all other values
// less.
inline std::uint32_t magnitude_bits(float x) { return std::bit_cast<std::uint32_t>(x) & 0x7fffffffu; }
constexpr std::uint32_t infinity_bits = 0x7f800000u;

inline bool all_finite(std::span<const Vec3f> values)
{
    const float* x = coordinates(values);
    std::uint32_t largest = 0;
    for (std::size_t l = 0; l < 3 * values.size(); ++l) largest = std::max(largest, magnitude_bits(x[l]));
    return largest < infinity_bits;
}

// An axis-aligned box; empty until something extends it. An unbounded shape has infinite corners.
using Box3f = Eigen::AlignedBox3f;
using Box3d = Eigen::AlignedBox3d;

}  // namespace rapid
