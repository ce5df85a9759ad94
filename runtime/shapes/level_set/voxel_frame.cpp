#include "runtime/shapes/level_set/voxel_frame.h"

namespace rapid {

VoxelFrame frame_around(const Box3d& bounds, double voxel)
{
    // Beyond this, mesh corners in single precision would have an error of more than 1/2048 of a voxel.
    constexpr double far = 16384;  // voxels
    VoxelFrame frame{voxel};
    const double farthest = bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).maxCoeff() / voxel;
    if (farthest > far) frame.origin = (bounds.center() / voxel).array().round().matrix() * voxel;
    return frame;
}

}  // namespace rapid
