// The voxels near a mesh, and how far each is from it: exact, by blocks of 8³ voxels.
//
// A triangle goes down through boxes of blocks, each halved, while it may be within the band of one of their voxels. In
// a block each voxel takes the nearest of its triangles.
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
    static constexpr std::size_t voxels = block * block * block;  // of a block: shape [x, y, z], z fastest

    // mesh: in voxels, those of whole numbers; outlives this. half_width: voxels.
    MeshBand(const Mesh& mesh, double half_width);

    std::size_t size() const { return blocks_.size(); }
    // The lowest voxel of a block.
    Eigen::Vector3i origin(std::size_t b) const { return block * blocks_[b].place; }
    // Of each voxel of a block the nearest triangle, and how far that is, in voxels: -1 and half_width where all are
    // beyond the band. Of equally near ones the first.
    void measure(std::size_t b, std::span<float, voxels> distance, std::span<std::int32_t, voxels> nearest) const;

private:
    struct Block {
        Eigen::Vector3i place;       // in blocks
        std::size_t first = 0, end;  // of triangles_
    };

    const Mesh& mesh_;
    double half_width_;
    std::vector<Block> blocks_;
    std::vector<std::int32_t> triangles_;
};

}  // namespace rapid
