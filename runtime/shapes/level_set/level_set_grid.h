// The OpenVDB grid of a level set, and the functions that build it. Includes OpenVDB; level_set.h is enough for
// queries.
#pragma once

#include <functional>
#include <memory>

#include "runtime/base/openvdb_grids.h"
#include "runtime/shapes/level_set/baked_level_set.h"
#include "runtime/shapes/level_set/voxel_blocks.h"

namespace rapid {

struct LevelSetGrid {
    openvdb::FloatGrid::ConstPtr grid;
};

using BakedPtr = std::shared_ptr<const BakedLevelSet>;

inline const openvdb::FloatGrid& grid_of(const BakedLevelSet& level_set) { return *level_set.grid()->grid; }

// Bakes the band of a level set for queries. The grid's map must be a uniform scale and a translation.
BakedGrid bake(const openvdb::FloatGrid& grid);

// Builds the same surface with another half width, in metres, from the grid's own source if that is known.
using RebuildGrid = std::function<openvdb::FloatGrid::Ptr(double half_width)>;

// Creates a level set from a grid, which is shared from here on and must not change.
BakedPtr level_set_of(openvdb::FloatGrid::ConstPtr grid, RebuildGrid rebuild);

// Returns a grid whose tiles are all outside, without class and name. level_set_grid() completes it.
openvdb::FloatGrid::Ptr tree_of(const VoxelBlocks& blocks);

// Sets tiles to inside or outside according to adjacent voxels.
LevelSetGridPtr level_set_grid(const openvdb::FloatGrid::Ptr& grid);

// Widens the band of a grid without a known source, using its own surface as a mesh: new voxels get their distance to
// the mesh, and existing ones stay bit-identical.
openvdb::FloatGrid::Ptr widened(const openvdb::FloatGrid& grid, double half_width);

// Resamples the surface of a grid whose map turns, mirrors, shears or scales its axes unequally to cubes along the
// axes, and notes that (files/skipped_contents.h).
openvdb::FloatGrid::Ptr on_cubic_voxels(const openvdb::FloatGrid& grid);

// Resamples the surface of any level set to other voxels, through a mesh.
openvdb::FloatGrid::Ptr resampled_to(const LevelSetPtr& shape, const openvdb::math::Transform& transform,
                                     double half_width);

// Registers OpenVDB's types. Call it before the first grid is created or read.
void initialize_openvdb();

openvdb::math::Transform::Ptr transform_of(const VoxelFrame& frame);

}  // namespace rapid
