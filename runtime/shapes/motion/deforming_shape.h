// The surface of a mesh between one level set and the next (see deforming.h).
#pragma once

#include <memory>
#include <vector>

#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/body_path.h"

namespace rapid {

class MovingBody;
struct TriangleTree;

// The hierarchy of faces, for nearest-face queries; the same for all frames of a mesh, and for all its users.
std::shared_ptr<const TriangleTree> triangle_tree(const MeshPtr& mesh);

// begin, end: level sets of the mesh; begin is null if the interval begins with a jump: then the end's is carried back.
// curves: of the vertices, m, with times from 0 to 1. duration: s.
ShapePtr deforming_shape(const LevelSetPtr& begin, const LevelSetPtr& end,
                         const std::shared_ptr<const TriangleTree>& tree, std::vector<Cubic<Vec3d>> curves,
                         double duration);

// The surface alone, of faces that may be open (mesh_surface.h).
std::shared_ptr<const MovingBody> deforming_surface(const std::shared_ptr<const TriangleTree>& tree,
                                                    std::vector<Cubic<Vec3d>> curves, double duration);

}  // namespace rapid
