// The signed distance from a closed mesh, in the blocks of a narrow band.
#pragma once

#include <memory>

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

}  // namespace rapid
