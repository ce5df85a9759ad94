// Points to grids: what each point carries is spread over the voxels within its radius r,
//
//   density(x) = Σ w_i W_i(x) / voxel³        vectors(x) = Σ w_i W_i(x) v_i / Σ w_i W_i(x)
//
//   W_i(x) = (1 - |x - P_i|² / r²)³ / S_i     S_i: the sum of the numerators over all voxels
//
// so that the sum of a density over the voxels, times their volume, is that of the weights, and vectors are a mean that
// keeps Σ w v. Voxel centres are multiples of `voxel`. A voxel adds points in their order: the same bits on any number
// of threads.
#pragma once

#include <span>

#include "runtime/deferred.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/vector_grid.h"

namespace rapid {

struct SpreadPoints {
    std::span<const Vec3f> P;        // m, finite
    std::span<const float> radius;   // m, above 0, of which at least a voxel is taken; one for all, or shape [P]
    std::span<const float> weight;   // at least 0; likewise
    std::span<const Vec3f> vectors;  // shape [P]; empty for a density
    double voxel;                    // m
};

// Error: no points, what the members above exclude, more than memory holds; a density also, where all weights are 0.
RAPID_DEFERRED(density_of_points, DensityGridPtr(const SpreadPoints& points));
RAPID_DEFERRED(vectors_of_points, VectorGridPtr(const SpreadPoints& points));

}  // namespace rapid
