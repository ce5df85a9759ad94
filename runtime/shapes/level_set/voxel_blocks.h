// The narrow band of a level set as it is measured: the blocks of 8³ voxels that contain parts of it. Both the level
// set for queries and the OpenVDB grid (grid_on_demand.h) are built from it.
//
// Layout: one array per block, shape [8, 8, 8], z fastest, the same as OpenVDB's leaves.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/shapes/level_set/baked_grid.h"

namespace rapid {

// The placement of a level set's voxels: axis-aligned, with centres at integers.

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

struct VoxelBlocks {
    static constexpr int edge = BakedGrid::block;
    static constexpr std::size_t voxels = edge * edge * edge;  // per block
    using BlockCoord = Eigen::Vector3i;                        // in blocks
    using Flags = std::array<std::uint64_t, voxels / 64>;      // one bit per voxel

    VoxelFrame frame;
    double half_width;               // m
    std::vector<BlockCoord> coords;  // distinct
    std::vector<float> values;       // m; beyond the band, the background with the right sign
    std::vector<Flags> in_band;      // voxels in the band

    std::size_t size() const { return coords.size(); }
    float background() const { return static_cast<float>(half_width); }
    std::span<float, voxels> of(std::size_t b) { return std::span<float, voxels>(values.data() + b * voxels, voxels); }
    std::span<const float, voxels> of(std::size_t b) const
    {
        return std::span<const float, voxels>(values.data() + b * voxels, voxels);
    }
    std::uint64_t voxels_in_band() const;

    // Makes space for that many blocks. The caller sets their values and coords.
    void resize(std::size_t blocks);
    // Removes the blocks without voxels in the band. Calls moved(from, to) for each other block whose index changes.
    template <class Moved>
    void drop_empty(const Moved& moved)
    {
        std::size_t n = 0;
        for (std::size_t b = 0; b < size(); ++b) {
            if (in_band[b] == Flags{}) continue;
            if (n != b) move_block(b, n), moved(b, n);
            ++n;
        }
        resize(n);
    }

    static void mark(Flags& flags, std::size_t voxel) { flags[voxel / 64] |= std::uint64_t{1} << voxel % 64; }

private:
    void move_block(std::size_t from, std::size_t to);
};

// Bakes a copy for queries. Beyond the band, inside or outside follows from the preceding blocks along z, as signs
// change only within the band.
BakedGrid bake(const VoxelBlocks& blocks);

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
