// Birth positions on and in a level set.
#pragma once

#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

struct BakedGrid;

// Samples `surface`, the zero crossing as a mesh, and moves the positions onto the zero crossing of the field. Every
// birth has the element -1.
ScatterPtr scatter_on_surface(std::shared_ptr<const BakedGrid> grid, const MeshPtr& surface);
ScatterPtr scatter_in_volume(std::shared_ptr<const BakedGrid> grid);

}  // namespace rapid
