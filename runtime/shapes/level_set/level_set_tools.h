// Operations on level sets: combine, offset, smooth, resample, move, and build from points. A result is computed once
// and is a level set like any other.
#pragma once

#include <span>

#include "runtime/base/deferred.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/pose.h"

namespace rapid {

// Union, intersection or difference. If the voxels of b differ from a's in size or alignment, b is resampled to a's,
// with a warning if the sizes differ by more than rounding. Throws Error if the result is empty.
enum class Combine { Union, Intersect, Subtract };
RAPID_DEFERRED(combine_level_sets, LevelSetPtr(const LevelSetPtr& a, const LevelSetPtr& b, Combine how,
                                               std::vector<std::string>& warnings));

// Moves the surface outwards along its normal, in metres; inwards if negative. Throws Error if the result is empty.
RAPID_DEFERRED(offset_level_set, LevelSetPtr(const LevelSetPtr& shape, double metres));

// Applies Gaussian smoothing of the distance, `width` voxels wide, `iterations` times. Throws Error if the result is
// empty.
RAPID_DEFERRED(smooth_level_set, LevelSetPtr(const LevelSetPtr& shape, int width, int iterations));

// Resamples to another voxel size, m. Throws Error if the surface vanishes or needs too many voxels.
RAPID_DEFERRED(resample_level_set, LevelSetPtr(const LevelSetPtr& shape, double voxel));

// Moves a level set rigidly. Without a rotation the voxels move along and nothing is rebuilt. A rotated level set is
// queried in its own frame and resampled only when it is combined or written.
RAPID_DEFERRED(move_level_set, LevelSetPtr(const LevelSetPtr& shape, const Pose& pose));

// Builds the union of balls around points. radius: one for all, or shape [P]. Throws Error if there are no points, a
// radius is below 1.5 voxels (too small to be resolved), or there are too many voxels.
RAPID_DEFERRED(level_set_from_points,
               LevelSetPtr(std::span<const Vec3f> P, std::span<const float> radius, const LevelSetOptions& options));

}  // namespace rapid
