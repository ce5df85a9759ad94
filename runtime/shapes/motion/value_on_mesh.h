// Evaluates an attribute of a mesh at the position of its surface nearest to a point. Values at vertices and corners
// are interpolated linearly on the face; face values are constant.
#pragma once

#include <span>
#include <string_view>

#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/moving_body.h"

namespace rapid {

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
