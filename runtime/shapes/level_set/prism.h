// A lower bound on the distance to a triangle.
#pragma once

#include <algorithm>

#include "runtime/math/vec.h"

namespace rapid {

// The plane of a triangle and the planes through its edges perpendicular to it. They bound the distance with a few
// multiplications. The bound is exact next to an edge and too small past a corner.
class Prism {
public:
    Prism(const Vec3d& a, const Vec3d& b, const Vec3d& c)
        : up_((b - a).cross(c - a).stableNormalized()), height_(up_.dot(a))
    {
        const Vec3d corners[3] = {a, b, c};
        for (int k = 0; k < 3; ++k) {
            outward_[k] = (corners[(k + 1) % 3] - corners[k]).cross(up_).stableNormalized();
            edge_[k] = outward_[k].dot(corners[k]);
        }
    }

    // Returns the square of a lower bound on the distance.
    double square_at_least(const Vec3d& P) const
    {
        const double h = up_.dot(P) - height_;
        double lateral = 0;
        for (int k = 0; k < 3; ++k) lateral = std::max(lateral, outward_[k].dot(P) - edge_[k]);
        return h * h + lateral * lateral;
    }

private:
    Vec3d up_, outward_[3];  // unit vectors; zero if the triangle has no area
    double height_, edge_[3];
};

}  // namespace rapid
