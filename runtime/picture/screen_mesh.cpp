#include "runtime/picture/screen_mesh.h"

#include <cmath>
#include <limits>

namespace rapid {

ScreenMesh::ScreenMesh(const Mesh& mesh, const Lens& lens, float near) : lens_(lens), near_(near)
{
    std::vector<Vec3f> normals(mesh.positions.size(), Vec3f::Zero());
    std::vector<Vec3f> faces(mesh.triangles.size());
    for (std::size_t t = 0; t < faces.size(); ++t) {
        const auto& triangle = mesh.triangles[t];
        const Vec3f& a = mesh.positions[triangle[0]];
        faces[t] = (mesh.positions[triangle[1]] - a).cross(mesh.positions[triangle[2]] - a);
        for (int c = 0; c < 3; ++c) normals[triangle[c]] += faces[t];
        faces[t].normalize();
    }
    for (Vec3f& normal : normals) normal.normalize();

    constexpr float cos_40 = 0.766f;
    triangles_.reserve(faces.size());
    for (std::size_t t = 0; t < faces.size(); ++t) {
        ScreenCorner corners[3];
        for (int c = 0; c < 3; ++c) {
            const std::int32_t vertex = mesh.triangles[t][c];
            const bool round = faces[t].dot(normals[vertex]) > cos_40;
            corners[c] = {mesh.positions[vertex], round ? normals[vertex] : faces[t]};
        }
        add_clipped(corners);
    }
}

void ScreenMesh::add(const ScreenCorner& a, const ScreenCorner& b, const ScreenCorner& c)
{
    constexpr float infinite = std::numeric_limits<float>::infinity();
    ScreenTriangle triangle{{a, b, c}, infinite, -infinite};
    for (ScreenCorner& corner : triangle.corners) {
        const Vec3f s = lens_.project(corner.P);
        corner.screen = {s.x(), s.y(), lens_.parallel ? s.z() : 1 / s.z()};
        triangle.low_y = std::min(triangle.low_y, s.y());
        triangle.high_y = std::max(triangle.high_y, s.y());
    }
    if (std::isfinite(triangle.low_y) && std::isfinite(triangle.high_y)) triangles_.push_back(triangle);
}

void ScreenMesh::add_clipped(const ScreenCorner (&corners)[3])
{
    std::vector<ScreenCorner> kept;
    for (int c = 0; c < 3; ++c) {
        const ScreenCorner &a = corners[c], &b = corners[(c + 1) % 3];
        const float da = (a.P - lens_.origin).dot(lens_.forward) - near_;
        const float db = (b.P - lens_.origin).dot(lens_.forward) - near_;
        if (lens_.parallel || da > 0) kept.push_back(a);
        if (!lens_.parallel && (da > 0) != (db > 0)) {
            const float t = da / (da - db);
            kept.push_back({a.P + t * (b.P - a.P), (a.n + t * (b.n - a.n)).normalized()});
        }
    }
    for (std::size_t k = 2; k < kept.size(); ++k) add(kept[0], kept[k - 1], kept[k]);
}

Vec3f any_tangent(const Vec3f& n)
{
    const Vec3f axis = std::abs(n.y()) < 0.9f ? Vec3f::UnitY().eval() : Vec3f::UnitX().eval();
    return axis.cross(n).normalized();
}

Lens Lens::of_camera(const Camera& camera, int width, int height)
{
    Lens lens;
    lens.origin = camera.position.cast<float>();
    Vec3d forward = camera.target - camera.position;
    forward = forward.norm() > 0 ? forward.normalized().eval() : Vec3d(0, 0, -1);
    Vec3d right = forward.cross(Vec3d::UnitY());
    right = right.norm() > 1e-6 ? right.normalized().eval() : Vec3d::UnitX().eval();
    lens.forward = forward.cast<float>();
    lens.right = right.cast<float>();
    lens.up = right.cross(forward).cast<float>();
    lens.focal = static_cast<float>(0.5 * height / std::tan(0.5 * camera.fov));
    lens.center_x = 0.5f * static_cast<float>(width);
    lens.center_y = 0.5f * static_cast<float>(height);
    return lens;
}

Vec3d Camera::project(const Vec3d& P, int width, int height) const
{
    return Lens::of_camera(*this, width, height).project(P.cast<float>()).cast<double>();
}

}  // namespace rapid
