// The map of normals that belongs to a linear map of positions.
#pragma once

#include "runtime/math/vec.h"

namespace rapid {

// Returns the transpose of the inverse up to a positive factor, from the cofactors, which a singular map has too. It is
// 0 for normals that a singular map leaves undefined.
inline Eigen::Matrix3d normal_map(const Eigen::Matrix3d& map)
{
    Eigen::Matrix3d cofactors;
    for (int axis = 0; axis < 3; ++axis) cofactors.col(axis) = map.col((axis + 1) % 3).cross(map.col((axis + 2) % 3));
    return map.determinant() < 0 ? Eigen::Matrix3d(-cofactors) : cofactors;
}

}  // namespace rapid
