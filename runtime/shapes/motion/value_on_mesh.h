// What a mesh has of an attribute at the place of its surface that is nearest to a point: of vertices and corners
// linear on the face, of faces as it is.
#pragma once

#include <span>
#include <string_view>

#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/moving_body.h"

namespace rapid {

// The surface of a mesh (mesh_surface.h), as it moves or deforms; where it moves as a rigid body, also at rest.
struct MeshSurfaces {
    const MovingBody& now;
    const MovingBody* at_rest = nullptr;
};

// The numbers of the value, which are written: 1 or 3, or 0 where the mesh has no attribute of this name. time: s since
// the interval of the surface began. Normals, N, turn with the face.
int value_on_mesh(const Mesh& mesh, const MeshSurfaces& surfaces, std::string_view name, const Vec3d& P, double time,
                  std::span<double, 3> value);

}  // namespace rapid
