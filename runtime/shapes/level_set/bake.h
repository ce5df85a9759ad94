// Copies the blocks of a level set into the flat table of a BakedGrid.
#pragma once

#include <functional>

#include "runtime/shapes/level_set/baked_grid.h"

namespace rapid {

// The values of a block, shape [8, 8, 8], z fastest, or the one that all of it has; m.
struct BlockValues {
    const float* values = nullptr;
    float constant = 0;

    float at(int i, int j, int k) const
    {
        return values ? values[(i * BakedGrid::block + j) * BakedGrid::block + k] : constant;
    }
};

struct BlockTable {
    using Place = Eigen::Vector3i;  // in blocks
    using Reader = std::function<BlockValues(const Place& place)>;

    Eigen::AlignedBox3i with_values;  // the lowest and the highest of their places; empty where there are none
    double voxel, background;         // m
    std::function<Vec3d(const Vec3d& P)> to_world;  // m, of a place in voxels
    std::function<Reader()> reader;                 // of any place; a thread's own
};

BakedGrid bake(const BlockTable& blocks);

}  // namespace rapid
