// Operations on level sets: combine, offset, smooth, resample, move, and build from points. A result is built once, and
// is a level set like any other.
#pragma once

#include <span>

#include "runtime/deferred.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/pose.h"

namespace rapid {

// Union, intersection or difference. A b of another voxel size, or whose voxels lie elsewhere, is
// resampled to a's, with a warning if the sizes differ by more than rounding. Error: nothing is left.
enum class Combine { Union, Intersect, Subtract };
RAPID_DEFERRED(combine_level_sets, LevelSetPtr(const LevelSetPtr& a, const LevelSetPtr& b, Combine how,
                                               std::vector<std::string>& warnings));

// The surface moved outwards along its normal, in metres; inwards if below 0. Error: nothing is left.
RAPID_DEFERRED(offset_level_set, LevelSetPtr(const LevelSetPtr& shape, double metres));

// Gaussian smoothing of the distance, `width` voxels wide, `iterations` times. Error: nothing is left.
RAPID_DEFERRED(smooth_level_set, LevelSetPtr(const LevelSetPtr& shape, int width, int iterations));

// The same surface on voxels of another size, m. Error: it vanishes, or would take too many.
RAPID_DEFERRED(resample_level_set, LevelSetPtr(const LevelSetPtr& shape, double voxel));

// Moved rigidly. Without a rotation the voxels move along and nothing is rebuilt; a rotated level set is queried in its
// own frame, and resampled only when it is combined, or written.
RAPID_DEFERRED(move_level_set, LevelSetPtr(const LevelSetPtr& shape, const Pose& pose));

// The union of balls around points. radius: one for all, or shape [P]. Error: no points, a radius below 1.5 voxels (too
// small for the voxels), too many voxels.
RAPID_DEFERRED(level_set_from_points,
               LevelSetPtr(std::span<const Vec3f> P, std::span<const float> radius, const LevelSetOptions& options));

}  // namespace rapid
