// Directions that are uniform over the solid angle of a cone.
#pragma once

#include <cmath>

#include "runtime/vec.h"

namespace rapid {

class Cone {
public:
    explicit Cone(double half_angle) : depth_(2 * std::pow(std::sin(half_angle / 2), 2)) {}

    // A direction in the cone around `mean`, of mean's length. u, w: uniform in [0, 1).
    //
    // 1 - cos α is uniform in [0, 1 - cos θ], α: the angle to the axis, θ: the half angle.
    Vec3d turn(const Vec3d& mean, double u, double w) const
    {
        const double length = mean.norm();
        if (length == 0) return mean;
        const Vec3d d = mean / length;
        const double fall = depth_ * u;  // 1 - cos α: the cosine of a narrow cone would keep few digits
        const double side = std::sqrt(fall * (2 - fall));
        const double turn = 2 * EIGEN_PI * w;

        // An orthonormal basis around d without a branch on its direction (Duff et al. 2017).
        const double sign = std::copysign(1.0, d.z());
        const double a = -1 / (sign + d.z());
        const double b = d.x() * d.y() * a;
        const Vec3d e1(1 + sign * d.x() * d.x() * a, sign * b, -sign * d.x());
        const Vec3d e2(b, sign + d.y() * d.y() * a, -d.y());
        return length * ((1 - fall) * d + side * (std::cos(turn) * e1 + std::sin(turn) * e2));
    }

private:
    double depth_;  // 1 - cos θ
};

}  // namespace rapid
