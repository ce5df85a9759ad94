// The placement of a level set's voxels: axis-aligned, with centres at integers.
#pragma once

#include "runtime/vec.h"

namespace rapid {

struct VoxelFrame {
    double voxel;                  // m
    Vec3d origin = Vec3d::Zero();  // position of voxel 0, m

    Vec3d to_world(const Vec3d& P) const { return P * voxel + origin; }
    Vec3d to_voxels(const Vec3d& P) const { return (P - origin) * (1 / voxel); }
};

// Returns a frame with voxel centres at multiples of `voxel`, so that level sets of one voxel size combine without
// resampling. Far from the origin the frame is shifted by whole voxels, because mesh corners in voxels, and some of
// OpenVDB's index coordinates, are in single precision.
VoxelFrame frame_around(const Box3d& bounds, double voxel);

}  // namespace rapid
