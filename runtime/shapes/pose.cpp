#include "runtime/shapes/pose.h"

namespace rapid {

Pose Pose::inverse() const
{
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back * -translation / scale, back, 1 / scale};
}

Pose interpolate(const Pose& a, const Pose& b, double t)
{
    return {a.translation + t * (b.translation - a.translation), a.rotation.slerp(t, b.rotation).normalized(),
            a.scale + t * (b.scale - a.scale)};
}

}  // namespace rapid
