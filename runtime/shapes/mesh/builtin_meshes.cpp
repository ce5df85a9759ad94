// Meshes generated from a formula, or from given points and faces.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "runtime/base/error.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {
namespace {

constexpr double pi = std::numbers::pi;

void require_length(const char* mesh, const char* name, double value)
{
    if (!(value > 0) || !std::isfinite(value))
        throw Error(fmt::format("{} of a mesh {} = {:g} is out of range; it must be above 0", name, mesh, value));
}

void require_divisions(const char* mesh, int divisions, int least)
{
    // Each square of divisions has two triangles: more divisions would overflow 32-bit vertex numbers.
    constexpr int most = 32000;
    if (divisions < least || divisions > most)
        throw Error(fmt::format("divisions of a mesh {} = {} is out of range; it must be from {} to {}", mesh,
                                divisions, least, most));
}

void add_quad(Mesh& mesh, std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d)
{
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
}

}  // namespace

// Builds rings of latitude from the north pole (+y) to the south pole, half as many as there are meridians. All
// vertices are on the sphere, so the mesh is inside it.
MeshPtr make_sphere(double radius, int divisions, const Vec3d& center)
{
    require_length("sphere", "radius", radius);
    require_divisions("sphere", divisions, 3);

    const int meridians = divisions, rings = (divisions + 1) / 2;  // `rings` bands, rings - 1 circles between the poles
    auto mesh = std::make_shared<Mesh>();
    mesh->name = "sphere";
    mesh->positions.push_back((center + Vec3d(0, radius, 0)).cast<float>());
    for (int i = 1; i < rings; ++i)
        for (int j = 0; j < meridians; ++j) {
            const double polar = pi * i / rings, azimuth = 2 * pi * j / meridians;
            const Vec3d n(std::sin(polar) * std::cos(azimuth), std::cos(polar), std::sin(polar) * std::sin(azimuth));
            mesh->positions.push_back((center + radius * n).cast<float>());
        }
    mesh->positions.push_back((center - Vec3d(0, radius, 0)).cast<float>());

    const auto south = static_cast<std::int32_t>(mesh->positions.size()) - 1;
    const auto at = [&](int ring, int j) { return 1 + (ring - 1) * meridians + j % meridians; };
    for (int j = 0; j < meridians; ++j) mesh->triangles.push_back({0, at(1, j + 1), at(1, j)});
    for (int i = 1; i + 1 < rings; ++i)
        for (int j = 0; j < meridians; ++j) add_quad(*mesh, at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
    for (int j = 0; j < meridians; ++j) mesh->triangles.push_back({south, at(rings - 1, j), at(rings - 1, j + 1)});
    return mesh;
}

MeshPtr make_box(const Vec3d& size, const Vec3d& center)
{
    for (int axis = 0; axis < 3; ++axis) require_length("box", "size", size[axis]);

    auto mesh = std::make_shared<Mesh>();
    mesh->name = "box";
    for (int corner = 0; corner < 8; ++corner) {  // bit 0: +x, bit 1: +y, bit 2: +z
        const Vec3d side(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
        mesh->positions.push_back((center + size.cwiseProduct(side)).cast<float>());
    }
    add_quad(*mesh, 0, 4, 6, 2);  // -x
    add_quad(*mesh, 1, 3, 7, 5);  // +x
    add_quad(*mesh, 0, 1, 5, 4);  // -y
    add_quad(*mesh, 2, 6, 7, 3);  // +y
    add_quad(*mesh, 0, 2, 3, 1);  // -z
    add_quad(*mesh, 4, 5, 7, 6);  // +z
    return mesh;
}

MeshPtr make_grid(double size_x, double size_z, int divisions, const Vec3d& center)
{
    require_length("grid", "size", size_x);
    require_length("grid", "size", size_z);
    require_divisions("grid", divisions, 1);

    auto mesh = std::make_shared<Mesh>();
    mesh->name = "grid";
    for (int i = 0; i <= divisions; ++i)
        for (int j = 0; j <= divisions; ++j) {
            const Vec3d offset(size_x * (double(i) / divisions - 0.5), 0, size_z * (double(j) / divisions - 0.5));
            mesh->positions.push_back((center + offset).cast<float>());
        }
    const auto at = [&](int i, int j) { return i * (divisions + 1) + j; };
    for (int i = 0; i < divisions; ++i)
        for (int j = 0; j < divisions; ++j)
            add_quad(*mesh, at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));  // seen from +y
    return mesh;
}

MeshPtr make_torus(double radius, double tube, int divisions, const Vec3d& center)
{
    require_length("torus", "radius", radius);
    require_length("torus", "tube", tube);
    require_divisions("torus", divisions, 3);
    if (tube >= radius)
        throw Error(fmt::format("tube of a mesh torus = {:g} is out of range; it must be below its radius, {:g}", tube,
                                radius));

    // The tube's edges are about as long as the ring's, but there are at least three.
    const int around = divisions;
    const int across = std::max(3, static_cast<int>(std::lround(divisions * tube / radius)));
    auto mesh = std::make_shared<Mesh>();
    mesh->name = "torus";
    for (int i = 0; i < around; ++i)
        for (int j = 0; j < across; ++j) {
            const double u = 2 * pi * i / around, w = 2 * pi * j / across;
            const double ring = radius + tube * std::cos(w);
            mesh->positions.push_back(
                (center + Vec3d(ring * std::cos(u), tube * std::sin(w), ring * std::sin(u))).cast<float>());
        }
    const auto at = [&](int i, int j) { return (i % around) * across + j % across; };
    for (int i = 0; i < around; ++i)
        for (int j = 0; j < across; ++j) add_quad(*mesh, at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
    return mesh;
}

MeshPtr make_mesh(std::vector<Vec3f> points, const std::vector<std::vector<std::int32_t>>& faces)
{
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!points[i].allFinite())
            throw Error(fmt::format("point {} of a mesh is at ({}, {}, {}); coordinates must be finite", i,
                                    points[i].x(), points[i].y(), points[i].z()));

    auto mesh = std::make_shared<Mesh>();
    mesh->name = "points and faces";
    mesh->positions = std::move(points);
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const std::vector<std::int32_t>& face = faces[f];
        if (face.size() < 3)
            throw Error(fmt::format("face {} of a mesh has {} points; it must have at least 3", f, face.size()));
        for (const std::int32_t index : face)
            if (index < 0 || static_cast<std::size_t>(index) >= mesh->positions.size())
                throw Error(fmt::format("face {} of a mesh names point {}; points are numbered from 0 to {}", f, index,
                                        static_cast<std::ptrdiff_t>(mesh->positions.size()) - 1));
        for (std::size_t k = 2; k < face.size(); ++k) mesh->triangles.push_back({face[0], face[k - 1], face[k]});
    }
    return mesh;
}

}  // namespace rapid
