// The pose of a rigid body with uniform scale, and its velocity field.
#pragma once

#include "runtime/math/vec.h"

namespace rapid {

// Maps the rest position X of a body to translation + scale rotation X.
struct Pose {
    Vec3d translation = Vec3d::Zero();  // m
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    double scale = 1;  // above 0

    Vec3d operator*(const Vec3d& X) const { return translation + scale * (rotation * X); }
    // Composes two poses: `other` is applied first.
    Pose operator*(const Pose& other) const
    {
        return {*this * other.translation, (rotation * other.rotation).normalized(), scale * other.scale};
    }
    Pose inverse() const;
    Eigen::Affine3d affine() const { return Eigen::Translation3d(translation) * rotation * Eigen::Scaling(scale); }
};

// Interpolates from a (t = 0) to b (t = 1): translation and scale linearly, rotation spherically (slerp, the shorter
// way).
Pose interpolate(const Pose& a, const Pose& b, double t);

// The velocity field of a body that translates, rotates and grows: v(x) = linear + angular × r + growth r with r = x -
// about, m/s.
struct VelocityField {
    Vec3d linear = Vec3d::Zero();   // m/s
    Vec3d angular = Vec3d::Zero();  // rad/s
    double growth = 0;              // 1/s
    Vec3d about = Vec3d::Zero();    // m

    Vec3d at(const Vec3d& x) const { return linear + angular.cross(x - about) + growth * (x - about); }
};

}  // namespace rapid
