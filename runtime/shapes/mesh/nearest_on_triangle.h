// The position on a triangle that is nearest to a point.
#pragma once

#include <array>

#include "runtime/math/vec.h"

namespace rapid {

// Returns the weights of corners b and c at that position (Ericson 2005, 5.1.5). Corners may coincide.
inline std::array<double, 2> nearest_weights(const Vec3d& P, const Vec3d& a, const Vec3d& b, const Vec3d& c)
{
    const Vec3d ab = b - a, ac = c - a;
    const double d1 = ab.dot(P - a), d2 = ac.dot(P - a);
    if (d1 <= 0 && d2 <= 0) return {0, 0};
    const double d3 = ab.dot(P - b), d4 = ac.dot(P - b);
    if (d3 >= 0 && d4 <= d3) return {1, 0};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return {d1 / (d1 - d3), 0};
    const double d5 = ab.dot(P - c), d6 = ac.dot(P - c);
    if (d6 >= 0 && d5 <= d6) return {0, 1};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return {0, d2 / (d2 - d6)};
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double w = (d4 - d3) / (d4 - d3 + d5 - d6);
        return {1 - w, w};
    }
    return {vb / (va + vb + vc), vc / (va + vb + vc)};
}

inline Vec3d nearest_point(const Vec3d& P, const Vec3d& a, const Vec3d& b, const Vec3d& c)
{
    const auto [of_b, of_c] = nearest_weights(P, a, b, c);
    return a + of_b * (b - a) + of_c * (c - a);
}

}  // namespace rapid
