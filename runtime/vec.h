// Vectors as the runtime holds them: packed x y z, single precision in columns, double inside a step.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace rapid {

using Vec3f = Eigen::Vector3f;
using Vec3d = Eigen::Vector3d;
using Quatf = Eigen::Quaternionf;

static_assert(sizeof(Vec3f) == 12 && sizeof(Vec3d) == 24 && sizeof(Quatf) == 16, "columns are packed");

// An axis-aligned box; empty until something extends it. An unbounded shape has infinite corners.
using Box3f = Eigen::AlignedBox3f;
using Box3d = Eigen::AlignedBox3d;

}  // namespace rapid
