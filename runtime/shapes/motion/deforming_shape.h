// The surface of a mesh on its way from one level set to the next (see deforming.h).
#pragma once

#include <memory>
#include <vector>

#include "runtime/deferred.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/body_path.h"

namespace rapid {

struct TriangleTree;

// The faces, for a place to be seen from the nearest; the same for all shapes of a mesh.
RAPID_DEFERRED(triangle_tree, std::shared_ptr<const TriangleTree>(const MeshPtr& mesh));

// begin, end: level sets of the mesh; begin is null where the interval begins with a jump: then the end's goes back
// along the ways. ways: of each vertex, m, with times from 0 to 1. duration: s.
RAPID_DEFERRED(deforming_shape, ShapePtr(const LevelSetPtr& begin, const LevelSetPtr& end,
                                         const std::shared_ptr<const TriangleTree>& tree,
                                         std::vector<Cubic<Vec3d>> ways, double duration));

}  // namespace rapid
