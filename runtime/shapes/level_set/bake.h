// Copies the blocks of a level set into the flat table of a BakedGrid.
#pragma once

#include <functional>

#include "runtime/shapes/level_set/baked_grid.h"

namespace rapid {

// The values of a block, shape [8, 8, 8], z fastest, m; or the one value shared by the whole block.
struct BlockValues {
    const float* values = nullptr;
    float constant = 0;

    float at(int i, int j, int k) const
    {
        return values ? values[(i * BakedGrid::block + j) * BakedGrid::block + k] : constant;
    }
};

struct BlockTable {
    using BlockCoord = Eigen::Vector3i;  // in blocks
    using Reader = std::function<BlockValues(const BlockCoord& coord)>;

    Eigen::AlignedBox3i with_values;                // range of the blocks with values; empty if there are none
    double voxel, background;                       // m
    std::function<Vec3d(const Vec3d& P)> to_world;  // position in m of a point in voxels
    std::function<Reader()> reader;                 // creates a reader for any block; one per thread
};

BakedGrid bake(const BlockTable& blocks);

}  // namespace rapid
