#include "runtime/shapes/motion/mesh_surface.h"

#include <array>
#include <cmath>
#include <string>

#include "runtime/shapes/mesh/detailed_mesh.h"
#include "runtime/shapes/mesh/nearest_on_triangle.h"
#include "runtime/shapes/motion/body_path.h"
#include "runtime/shapes/motion/deforming_shape.h"
#include "runtime/shapes/motion/moving.h"

namespace rapid {
namespace {

// rest: the mesh with the same faces for which the tree is built.
MovingBodyPtr still_surface(const Mesh& mesh, const MeshPtr& rest)
{
    std::vector<Cubic<Vec3d>> curves;
    curves.reserve(mesh.positions.size());
    const Vec3d none = Vec3d::Zero();
    for (const Vec3f& P : mesh.positions) curves.push_back({P.cast<double>(), none, none, none});
    return deforming_surface(triangle_tree(rest), std::move(curves), 1);
}

}  // namespace

MovingBodyPtr mesh_surface(const MeshPtr& mesh) { return still_surface(*mesh, mesh); }

bool is_mesh_surface(const Shape& shape) { return shape.kind() == "mesh"; }

MovingBodyPtr mesh_surface_at_start(const AnimatedMesh& mesh, const FrameClock& clock)
{
    return still_surface(*mesh.at(clock, clock.start), mesh.rest());
}

MovingBodyPtr mesh_surface_in_step(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t step)
{
    if (!mesh.deforms()) {
        const AnimatedShape body(mesh_surface(mesh.rest()), mesh.motion());
        return std::static_pointer_cast<const MovingBody>(moving_in_step(body, clock, step, {}).shape);
    }
    const FrameClock frames{clock.fps, clock.start};
    const double from = clock.at_step(step - 1).number, to = clock.at_step(step).number;
    const auto frame = static_cast<std::int64_t>(std::ceil(to));
    const FramePath path = path_of(mesh, frames, frame, {});
    if (path.kind == FramePath::Still) return still_surface(*mesh.at(frames, frame), mesh.rest());
    const double whole = static_cast<double>(frame) - 1;
    std::vector<Cubic<Vec3d>> curves = vertex_curves(mesh, frames, frame, path);
    for (Cubic<Vec3d>& curve : curves) curve = cubic_part(curve, from - whole, to - whole);
    return deforming_surface(triangle_tree(mesh.rest()), std::move(curves), (to - from) / clock.fps);
}

namespace {

using Corners = std::array<Vec3d, 3>;

Corners corners_at_rest(const Mesh& mesh, std::size_t face)
{
    const auto corner = [&](int k) -> Vec3d {
        return mesh.positions[static_cast<std::size_t>(mesh.triangles[face][k])].cast<double>();
    };
    return {corner(0), corner(1), corner(2)};
}

Corners corners_now(const Corners& rest, const MeshSurfaces& surfaces, std::int32_t face, double time)
{
    const Vec3d coordinates[] = {Vec3d::Zero(), Vec3d::UnitX(), Vec3d::UnitY()};
    Corners now;
    for (std::size_t k = 0; k < now.size(); ++k) {
        const MaterialPoint on_face{face, coordinates[k]}, of_body{MaterialPoint::rigid, rest[k]};
        now[k] = surfaces.now.follow(surfaces.at_rest ? of_body : on_face, time).P;
    }
    return now;
}

// Returns a tangent, the other one and the normal, of length 1, as columns.
Eigen::Matrix3d frame_of(const Corners& corners)
{
    const Vec3d edge = (corners[1] - corners[0]).normalized();
    const Vec3d normal = edge.cross(corners[2] - corners[0]).normalized();
    Eigen::Matrix3d frame;
    frame << edge, normal.cross(edge), normal;
    return frame;
}

// Interpolates values linearly on a face. indices: indices of its corners in the list.
template <class T>
T linear(const std::vector<T>& list, const std::array<std::size_t, 3>& indices, const std::array<double, 2>& weights)
{
    const auto b1 = static_cast<float>(weights[0]), b2 = static_cast<float>(weights[1]);
    return list[indices[0]] * (1 - b1 - b2) + list[indices[1]] * b1 + list[indices[2]] * b2;
}

const Mesh::VertexValues* find(const std::map<std::string, Mesh::VertexValues>& values, const std::string& name)
{
    const auto found = values.find(name);
    return found == values.end() ? nullptr : &found->second;
}

}  // namespace

int value_on_mesh(const Mesh& mesh, const MeshSurfaces& surfaces, std::string_view name, const Vec3d& P, double time,
                  std::span<double, 3> value)
{
    const std::string key(name);
    const auto* detailed = dynamic_cast<const DetailedMesh*>(&mesh);
    const auto* of_vertices = find(mesh.values, key);
    const auto* of_corners = detailed && !of_vertices ? find(detailed->corner_values, key) : nullptr;
    const auto* of_faces = detailed && !of_vertices && !of_corners ? find(detailed->face_values, key) : nullptr;
    const auto* values = of_vertices ? of_vertices : of_corners ? of_corners : of_faces;
    if (!values) return 0;

    const MaterialPoint here = surfaces.now.material_at(P, time);
    const std::int32_t face = surfaces.at_rest ? surfaces.at_rest->material_at(here.at, 0).face : here.face;
    const auto f = static_cast<std::size_t>(face);
    const Corners rest = corners_at_rest(mesh, f), now = corners_now(rest, surfaces, face, time);
    std::array<std::size_t, 3> indices = {f, f, f};
    for (std::size_t k = 0; k < indices.size() && !of_faces; ++k)
        indices[k] = of_corners ? 3 * f + k : static_cast<std::size_t>(mesh.triangles[f][static_cast<int>(k)]);
    const std::array<double, 2> weights = of_faces ? std::array{0.0, 0.0} : nearest_weights(P, now[0], now[1], now[2]);
    if (const auto* numbers = std::get_if<std::vector<float>>(values)) {
        value[0] = linear(*numbers, indices, weights);
        return 1;
    }
    Vec3d vector = linear(std::get<std::vector<Vec3f>>(*values), indices, weights).cast<double>();
    if (name == "N") vector = frame_of(now) * (frame_of(rest).transpose() * vector);
    Eigen::Map<Vec3d>(value.data(), 3) = vector;
    return 3;
}

}  // namespace rapid
