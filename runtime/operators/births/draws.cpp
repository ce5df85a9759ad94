#include "runtime/operators/births/draws.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/math/elementary.h"
#include "runtime/math/simd.h"

namespace rapid {
namespace {

// Returns 1 with the sign of each element.
Doubles signs_of(const Doubles& x)
{
    return std::bit_cast<Doubles>((std::bit_cast<Flags>(x) & INT64_MIN) | std::bit_cast<std::int64_t>(1.0));
}

// u, w: uniform in [0, 1). depth: 1 - cos θ.
//
// 1 - cos α is uniform in [0, 1 - cos θ], α: the angle to the axis, θ: the half angle.
Vectors<Doubles> turned(const Vectors<Doubles>& mean, double depth, const Doubles& u, const Doubles& w)
{
    const Doubles length = sqrt(dot(mean, mean));
    const Vectors<Doubles> d{mean.x / length, mean.y / length, mean.z / length};
    const Doubles fall = depth * u;  // 1 - cos α: the cosine of a narrow cone would lose digits
    const Doubles side = sqrt(fall * (2 - fall));
    const Doubles turn = 2 * std::numbers::pi * w;

    // An orthonormal basis around d without a branch on its direction (Duff et al. 2017).
    const Doubles sign = signs_of(d.z);
    const Doubles a = -1 / (sign + d.z);
    const Doubles b = d.x * d.y * a;
    const Vectors<Doubles> e1{1 + sign * d.x * d.x * a, sign * b, -sign * d.x};
    const Vectors<Doubles> e2{b, sign + d.y * d.y * a, -d.y};
    const Vectors<Doubles> result = length * ((1 - fall) * d + side * (cosine(turn) * e1 + sine(turn) * e2));
    const Flags none = length == 0;  // has no direction
    return {none ? mean.x : result.x, none ? mean.y : result.y, none ? mean.z : result.z};
}

}  // namespace

Cone::Cone(double half_angle) : depth_(2 * std::pow(std::sin(half_angle / 2), 2)) {}

void Cone::turn(std::span<Vec3d> vectors, std::span<const Draws> draws) const
{
    for (std::size_t begin = 0; begin < vectors.size(); begin += lanes) {
        const std::uint32_t count = static_cast<std::uint32_t>(std::min<std::size_t>(lanes, vectors.size() - begin));
        Indices indices;  // lanes beyond the last vector repeat it
        for (std::uint32_t l = 0; l < lanes; ++l)
            indices[l] = static_cast<std::uint32_t>(begin) + std::min(l, count - 1);
        Doubles u, w;
        for (std::uint32_t l = 0; l < lanes; ++l) {
            u[l] = draws[indices[l]][cone_draw];
            w[l] = draws[indices[l]][turn_draw];
        }
        scatter(turned(gather(vectors, indices), depth_, u, w), vectors, indices, count);
    }
}

}  // namespace rapid
