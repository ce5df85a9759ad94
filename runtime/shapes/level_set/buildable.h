// Checks whether a level set can be built.
#pragma once

#include <string_view>

#include "runtime/shapes/level_set/level_set.h"

namespace rapid {

// Throws Error if the voxel size or the half width is out of range.
void require_legal(const LevelSetOptions& options);

// Throws Error, before anything is built, if a level set of a surface of this area (m²) in these bounds would have over
// 2^31 voxels, too large an index, or need more memory than the machine has. what: its name in the message, `mesh
// "bunny.obj"`.
void require_buildable(std::string_view what, double area, const Box3d& bounds, const LevelSetOptions& options);

}  // namespace rapid
