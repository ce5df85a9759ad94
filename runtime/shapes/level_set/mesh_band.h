// The voxels near a mesh and their exact distances from it, in blocks of 8³ voxels.
//
// A triangle descends through boxes of blocks, halved at each level, while it may be within the band of one of their
// voxels. Within a block each voxel takes the nearest of the block's triangles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/shapes/level_set/baked_grid.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

class MeshBand {
public:
    static constexpr int block = BakedGrid::block;
    static constexpr std::size_t voxels = block * block * block;  // per block: shape [x, y, z], z fastest

    // mesh: in voxel units, with voxel centres at integers; must outlive this. half_width: voxels.
    MeshBand(const Mesh& mesh, double half_width);

    std::size_t size() const { return blocks_.size(); }
    // Returns the lowest voxel of a block.
    Eigen::Vector3i origin(std::size_t b) const { return block * blocks_[b].coord; }
    // Computes, for each voxel of a block, the nearest triangle (the first one in a tie) and its distance in voxels. A
    // voxel beyond the band gets -1 and half_width.
    void measure(std::size_t b, std::span<float, voxels> distance, std::span<std::int32_t, voxels> nearest) const;

private:
    struct Block {
        Eigen::Vector3i coord;       // in blocks
        std::size_t first = 0, end;  // of triangles_
    };

    const Mesh& mesh_;
    double half_width_;
    std::vector<Block> blocks_;
    std::vector<std::int32_t> triangles_;
};

}  // namespace rapid
