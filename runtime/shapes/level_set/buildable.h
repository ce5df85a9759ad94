// What of level sets can be built.
#pragma once

#include <string_view>

#include "runtime/shapes/level_set/level_set.h"

namespace rapid {

// Error: a voxel or half width out of range.
void require_legal(const LevelSetOptions& options);

// Error, before anything is built, when a level set of a surface of this area (m²) in these bounds would have over 2^31
// voxels, too large an index, or more memory than the machine has. what: its name, `mesh "bunny.obj"`.
void require_buildable(std::string_view what, double area, const Box3d& bounds, const LevelSetOptions& options);

}  // namespace rapid
