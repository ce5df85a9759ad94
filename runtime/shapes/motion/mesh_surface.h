// The surface of a mesh, static, moving or deforming: the unsigned distance to its nearest face, exact everywhere. The
// mesh may be open. It has no inside, and nothing collides with it.
#pragma once

#include <span>
#include <string_view>

#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/motion/moving_body.h"

namespace rapid {

using MovingBodyPtr = std::shared_ptr<const MovingBody>;

MovingBodyPtr mesh_surface(const MeshPtr& mesh);
// Returns true if a shape is a mesh surface, whose distance is above 0 on both sides.
bool is_mesh_surface(const Shape& shape);

// Returns the surface at the start, or during a step. Times are in seconds since the step began, and distance() applies
// to its end. Vertices of a sequence follow the curves of body_path.h. Single-threaded, because the motion may be a
// script.
MovingBodyPtr mesh_surface_at_start(const AnimatedMesh& mesh, const FrameClock& clock);
MovingBodyPtr mesh_surface_in_step(const AnimatedMesh& mesh, const FrameClock& clock, std::int64_t step);

// Evaluates an attribute of a mesh at the position of its surface nearest to a point. Values at vertices and corners
// are interpolated linearly on the face; face values are constant.

// The surface of a mesh (mesh_surface.h) as it moves or deforms. If it moves rigidly, also its rest surface.
struct MeshSurfaces {
    const MovingBody& now;
    const MovingBody* at_rest = nullptr;
};

// Writes the value and returns its number of components: 1 or 3, or 0 if the mesh has no attribute of this name. time:
// s since the beginning of the surface's interval. Normals, N, turn with the face.
int value_on_mesh(const Mesh& mesh, const MeshSurfaces& surfaces, std::string_view name, const Vec3d& P, double time,
                  std::span<double, 3> value);

}  // namespace rapid
