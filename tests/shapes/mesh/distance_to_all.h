// The distance to a mesh, computed from its edges and planes.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/shapes/mesh/mesh.h"

namespace rapid::test {

// Returns the distance to the nearest of all triangles. Triangles may be degenerate (lines and points).
inline double distance_to_all(const Mesh& mesh, const Vec3d& P)
{
    double least = std::numeric_limits<double>::infinity();
    for (const Mesh::Triangle& t : mesh.triangles) {
        const Vec3d a = mesh.positions[t[0]].cast<double>(), b = mesh.positions[t[1]].cast<double>();
        const Vec3d c = mesh.positions[t[2]].cast<double>();
        const auto to_segment = [&](const Vec3d& from, const Vec3d& to) {
            const double length2 = (to - from).squaredNorm();
            const double s = length2 > 0 ? std::clamp((P - from).dot(to - from) / length2, 0.0, 1.0) : 0;
            return (P - from - s * (to - from)).norm();
        };
        least = std::min({least, to_segment(a, b), to_segment(b, c), to_segment(c, a)});
        const Vec3d n = (b - a).cross(c - a).stableNormalized();
        if (n.isZero(0)) continue;
        const Vec3d foot = P - n.dot(P - a) * n;
        const bool over = n.dot((b - a).cross(foot - a)) >= 0 && n.dot((c - b).cross(foot - b)) >= 0 &&
                          n.dot((a - c).cross(foot - c)) >= 0;
        if (over) least = std::min(least, std::abs(n.dot(P - a)));
    }
    return least;
}

}  // namespace rapid::test
