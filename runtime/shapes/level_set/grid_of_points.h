// Converts points to grids: spreads each point's quantity over the voxels within its radius r,
//
//   density(x) = Σ w_i W_i(x) / voxel³        vectors(x) = Σ w_i W_i(x) v_i / Σ w_i W_i(x)
//
//   W_i(x) = (1 - |x - P_i|² / r²)³ / S_i     S_i: the sum of the numerators over all voxels
//
// so that the integral of a density is the sum of the weights, and vectors are a weighted mean that preserves Σ w v.
// Voxel centres are multiples of `voxel`. Each voxel adds its points in their order, so the result is bit-identical for
// any number of threads.
#pragma once

#include <span>

#include "runtime/base/deferred.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/vector_grid.h"

namespace rapid {

struct SpreadPoints {
    std::span<const Vec3f> P;        // m, finite
    std::span<const float> radius;   // m, above 0, raised to at least a voxel; one for all, or shape [P]
    std::span<const float> weight;   // at least 0; one for all, or shape [P]
    std::span<const Vec3f> vectors;  // shape [P]; empty for a density
    double voxel;                    // m
};

// Both throw Error if there are no points, a member above is out of range, or memory is exceeded. A density also throws
// if all weights are 0.
RAPID_DEFERRED(density_of_points, DensityGridPtr(const SpreadPoints& points));
RAPID_DEFERRED(vectors_of_points, VectorGridPtr(const SpreadPoints& points));

}  // namespace rapid
