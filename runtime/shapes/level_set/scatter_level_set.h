// Births on and in a level set.
#pragma once

#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

struct BakedGrid;

// On `surface`, the zero crossing as a mesh, moved onto that of the field; a birth's element is -1.
ScatterPtr scatter_on_surface(std::shared_ptr<const BakedGrid> grid, const MeshPtr& surface);
ScatterPtr scatter_in_volume(std::shared_ptr<const BakedGrid> grid);

}  // namespace rapid
