// The voxel size of a grid of points.
#pragma once

#include "runtime/points/point_set.h"

namespace rapid {

// The exponent e of the voxel size 2^e m with which a leaf that holds points holds some 2,000 of them. Error: a
// position that is not finite.
int voxel_exponent(const PointSet& points);

}  // namespace rapid
