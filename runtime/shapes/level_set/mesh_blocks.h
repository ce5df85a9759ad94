// The signed distance from a closed mesh, in the blocks of a narrow band.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/shapes/level_set/baked_grid.h"
#include "runtime/shapes/level_set/voxel_blocks.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/mesh/ray_crossings.h"

namespace rapid {

struct MeshBlocks {
    static constexpr double widest = 5;  // voxels; in a wider band every voxel has too many triangles to test

    std::shared_ptr<const Mesh> mesh;  // in voxel units
    VoxelBlocks blocks;
    std::vector<std::int32_t> nearest;  // nearest triangle per voxel, laid out like the values; -1 beyond the band
    // True if some faces lie inside: their winding number is nonzero on both sides. Distances of inner voxels may then
    // refer to such a face, which is not a surface.
    bool overlap = false;
};

MeshPtr in_voxels(const Mesh& mesh, const VoxelFrame& frame);

// Measures the distance of a mesh whose edges are all balanced. The inside is where the winding number is not 0.
// half_width: m, at most `widest` voxels.
MeshBlocks measure(const Mesh& mesh, const VoxelFrame& frame, double half_width);

// Negates the distances of a block where the winding number is not 0, by rows of voxels along x. lowest: the block's
// lowest voxel. crossings: scratch memory. Returns true if any faces lie inside.
bool sign_by_windings(const RayCrossings& faces, const Eigen::Vector3i& lowest,
                      std::span<float, VoxelBlocks::voxels> distance, std::vector<RayCrossings::Crossing>& crossings);

// The voxels near a mesh and their exact distances from it, in blocks of 8³ voxels.
//
// A triangle descends through boxes of blocks, halved at each level, while it may be within the band of one of their
// voxels. Within a block each voxel takes the nearest of the block's triangles.
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

// The plane of a triangle and the planes through its edges perpendicular to it. They bound the distance with a few
// multiplications. The bound is exact next to an edge and too small past a corner.
class Prism {
public:
    Prism(const Vec3d& a, const Vec3d& b, const Vec3d& c)
        : up_((b - a).cross(c - a).stableNormalized()), height_(up_.dot(a))
    {
        const Vec3d corners[3] = {a, b, c};
        for (int k = 0; k < 3; ++k) {
            outward_[k] = (corners[(k + 1) % 3] - corners[k]).cross(up_).stableNormalized();
            edge_[k] = outward_[k].dot(corners[k]);
        }
    }

    // Returns the square of a lower bound on the distance.
    double square_at_least(const Vec3d& P) const
    {
        const double h = up_.dot(P) - height_;
        double lateral = 0;
        for (int k = 0; k < 3; ++k) lateral = std::max(lateral, outward_[k].dot(P) - edge_[k]);
        return h * h + lateral * lateral;
    }

private:
    Vec3d up_, outward_[3];  // unit vectors; zero if the triangle has no area
    double height_, edge_[3];
};

}  // namespace rapid
