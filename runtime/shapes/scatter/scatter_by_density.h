// Births on a mesh with a density at the corners of its faces.
#pragma once

#include <span>

#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

// Samples by area times the density: shape [triangles, 3], at least 0, linear on each face. areas: of the faces, m², in
// place of those of the mesh; may be empty. Throws Error if the mesh has no area or the density is 0 everywhere.
ScatterPtr scatter_by_density(const MeshPtr& mesh, std::span<const float> density, std::span<const double> areas = {});

}  // namespace rapid
