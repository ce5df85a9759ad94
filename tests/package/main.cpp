// The first steps of an embedder: a moving mesh, a set of points, the registered nodes and formats. Exits with status 0
// if everything is right.
#include <cmath>
#include <cstdio>

#include "runtime/graph/registry.h"
#include "runtime/io/format.h"
#include "runtime/points/point_set.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/mesh/mesh.h"

namespace {

int wrong = 0;

void expect(bool holds, const char* sentence)
{
    if (holds) return;
    std::fprintf(stderr, "does not hold: %s\n", sentence);
    ++wrong;
}

}  // namespace

int main()
{
    rapid::PointSet points;
    points.append(3);
    points.P().write()[2] = rapid::Vec3f(1, 2, 3);
    expect(points.P()[2].y() == 2, "a point's position is what was written");

    // The library was compiled for wider vectors than this program: the map must have the same layout in both.
    Eigen::Affine3d map(Eigen::Translation3d(10, 0, 0));
    map.scale(2);
    const rapid::MeshPtr mesh = rapid::transformed(rapid::make_box({1, 1, 1}, {0, 0, 0}), map);
    expect(std::abs(mesh->signed_volume() - 8) < 1e-9, "a cube that is scaled by 2 has 8 times the volume");
    expect((mesh->bounds().center() - rapid::Vec3f(10, 0, 0)).norm() < 1e-6f, "a mesh is where it was moved to");

    const rapid::LevelSetPtr ball = rapid::level_set_sphere(1, {0, 0, 0}, {0.1, 3});
    expect(std::abs(ball->surface()->signed_volume() - 4.19) < 0.1, "what needs OpenVDB is loaded when it is called");

    expect(rapid::Registry().find("gravity") != nullptr, "the nodes are linked");
    expect(rapid::format_of("drop.csv").read != nullptr, "the formats are linked");

    try {
        rapid::Registry().at("gravty");
        expect(false, "an unknown node is an error");
    } catch (const rapid::Error& error) {
        expect(error.message().find("gravity") != std::string::npos, "the library's errors can be caught here");
    }
    return wrong;
}
