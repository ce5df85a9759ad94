#include "runtime/shapes/motion/mesh_surface.h"

#include <cmath>

#include "runtime/shapes/motion/cubic_part.h"
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

}  // namespace rapid
