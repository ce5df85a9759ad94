#include "runtime/graph/points_object.h"

namespace rapid {

std::shared_ptr<const PointsObject> transformed(const PointsObject& points, const Pose& pose)
{
    auto result = std::make_shared<PointsObject>();
    result->points = points.points;
    const auto map = pose.affine();
    const auto each = [](Column<Vec3f>& column, const auto& f) {
        for (Vec3f& value : column.write()) value = Vec3d(f(value.cast<double>())).template cast<float>();
    };
    each(result->points.P(), [&](const Vec3d& P) -> Vec3d { return map * P; });
    each(result->points.v(), [&](const Vec3d& v) -> Vec3d { return map.linear() * v; });
    if (auto* normals = result->points.find<Vec3f>("N"))
        each(*normals, [&](const Vec3d& N) -> Vec3d { return pose.rotation * N; });
    return result;
}

}  // namespace rapid
