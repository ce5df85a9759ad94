// Chooses the voxel size of a point grid.
#pragma once

#include "runtime/points/point_set.h"

namespace rapid {

// Returns the exponent e of a voxel size 2^e m at which an occupied leaf has about 2,000 points. Throws Error if a
// position is not finite.
int voxel_exponent(const PointSet& points);

}  // namespace rapid
