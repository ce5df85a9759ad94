// The surface of a mesh between two consecutive level sets (see deforming.h).
#pragma once

#include <memory>
#include <vector>

#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/motion/body_path.h"

namespace rapid {

class MovingBody;
struct TriangleTree;

// Returns the hierarchy of faces for nearest-face queries. All frames and users of a mesh share it.
std::shared_ptr<const TriangleTree> triangle_tree(const MeshPtr& mesh);

// Creates the surface during an interval. begin, end: level sets of the mesh. If the interval begins with a jump, begin
// is null and only `end` is used, carried back with the faces. curves: of the vertices, m, with times from 0 to 1.
// duration: s.
ShapePtr deforming_shape(const LevelSetPtr& begin, const LevelSetPtr& end,
                         const std::shared_ptr<const TriangleTree>& tree, std::vector<Cubic<Vec3d>> curves,
                         double duration);

// Creates the surface without an inside; its faces may be open (mesh_surface.h).
std::shared_ptr<const MovingBody> deforming_surface(const std::shared_ptr<const TriangleTree>& tree,
                                                    std::vector<Cubic<Vec3d>> curves, double duration);

}  // namespace rapid
