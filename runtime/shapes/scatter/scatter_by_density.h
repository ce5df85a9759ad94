// Births on a mesh by a density at the corners of its faces.
#pragma once

#include <span>

#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

// Births by area, times the density: shape [triangles, 3], at least 0, linear on each face. Error: a mesh of no area; a
// density that is 0 everywhere.
ScatterPtr scatter_by_density(const MeshPtr& mesh, std::span<const float> density);

}  // namespace rapid
