#include "runtime/shapes/mesh/mesh.h"

#include <algorithm>
#include <cmath>

#include "runtime/math/normal_map.h"
#include "runtime/shapes/mesh/detailed_mesh.h"

namespace rapid {

Box3f Mesh::bounds() const
{
    Box3f box;
    for (const Vec3f& P : positions) box.extend(P);
    return box;
}

double Mesh::area() const
{
    double twice = 0;
    for (const Triangle& t : triangles) {
        const Vec3d a = positions[t[0]].cast<double>();
        twice += (positions[t[1]].cast<double>() - a).cross(positions[t[2]].cast<double>() - a).norm();
    }
    return twice / 2;
}

// Sums the tetrahedra (origin, a, b, c) over the faces (divergence theorem). For a closed mesh every origin gives the
// same result. The centre of the bounds loses the fewest digits far from the world's origin, and makes the result for
// an open mesh independent of its position.
double Mesh::signed_volume() const
{
    if (positions.empty()) return 0;
    const Vec3d origin = bounds().cast<double>().center();
    double six_times = 0;
    for (const Triangle& t : triangles) {
        const Vec3d a = positions[t[0]].cast<double>() - origin;
        const Vec3d b = positions[t[1]].cast<double>() - origin;
        const Vec3d c = positions[t[2]].cast<double>() - origin;
        six_times += a.dot(b.cross(c));
    }
    return six_times / 6;
}

Mesh::Openness Mesh::openness() const
{
    // An edge is a pair of vertices, lower index first, plus the direction of its face along it in the lowest bit.
    struct Side {
        std::uint64_t edge;
        bool forward;
    };
    std::vector<Side> sides;
    sides.reserve(3 * triangles.size());
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) {
            const auto from = static_cast<std::uint64_t>(t[k]), to = static_cast<std::uint64_t>(t[(k + 1) % 3]);
            sides.push_back({std::min(from, to) << 32 | std::max(from, to), from < to});
        }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.edge < b.edge; });

    Openness openness;
    for (std::size_t begin = 0, end; begin < sides.size(); begin = end) {
        std::size_t forward = 0;
        for (end = begin; end < sides.size() && sides[end].edge == sides[begin].edge; ++end)
            forward += sides[end].forward;
        const std::size_t faces = end - begin;
        openness.boundary_edges += faces == 1;
        openness.non_manifold_edges += faces > 2 || (faces == 2 && forward != 1);
        openness.odd_edges += faces % 2;
        openness.unbalanced_edges += 2 * forward != faces;
    }
    return openness;
}

namespace {

void turn_normals(DetailedMesh::Values& values, const Eigen::Matrix3d& map)
{
    const auto normals = values.find("N");
    auto* list = normals == values.end() ? nullptr : std::get_if<std::vector<Vec3f>>(&normals->second);
    if (!list) return;
    for (Vec3f& N : *list) {
        const Vec3d turned = map * N.cast<double>();
        if (turned.norm() > 0) N = turned.normalized().cast<float>();
    }
}

// Swaps the values of the second and third corner of each face.
void swap_corners(DetailedMesh::Values& values)
{
    for (auto& [name, any] : values)
        std::visit(
            [](auto& list) {
                for (std::size_t c = 0; c < list.size(); c += 3) std::swap(list[c + 1], list[c + 2]);
            },
            any);
}

}  // namespace

MeshPtr transformed(const MeshPtr& mesh, const Eigen::Affine3d& map)
{
    const DetailedMeshPtr details = detailed(mesh);
    const auto turned = details ? std::make_shared<DetailedMesh>(*details) : nullptr;
    const std::shared_ptr<Mesh> moved = turned ? turned : std::make_shared<Mesh>(*mesh);
    for (Vec3f& P : moved->positions) P = (map * P.cast<double>()).cast<float>();
    const Eigen::Matrix3d of_normals = normal_map(map.linear());
    turn_normals(moved->values, of_normals);
    const bool mirrors = map.linear().determinant() < 0;
    if (mirrors)
        for (Mesh::Triangle& t : moved->triangles) std::swap(t[1], t[2]);
    if (turned) {
        turn_normals(turned->corner_values, of_normals);
        turn_normals(turned->face_values, of_normals);
        if (mirrors) swap_corners(turned->corner_values);
    }
    return moved;
}

}  // namespace rapid
