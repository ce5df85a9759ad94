// The signed distance from a closed mesh, in the blocks of a narrow band.
#pragma once

#include <memory>

#include "runtime/shapes/level_set/voxel_blocks.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/mesh/ray_crossings.h"

namespace rapid {

struct MeshBlocks {
    static constexpr double widest = 5;  // voxels: in a wider band each has too many triangles about it to ask

    std::shared_ptr<const Mesh> mesh;  // in voxels
    VoxelBlocks blocks;
    std::vector<std::int32_t> nearest;  // triangle of each voxel, laid out as their values; -1 beyond the band
    // Faces lie inside, with a winding number other than 0 on both their sides: the distances of voxels inside may be
    // to one of them, which is no surface.
    bool overlap = false;
};

MeshPtr in_voxels(const Mesh& mesh, const VoxelFrame& frame);

// Inside is where the winding number is not 0. Each edge of the mesh is balanced. half_width: m, at most `widest`
// voxels.
MeshBlocks measure(const Mesh& mesh, const VoxelFrame& frame, double half_width);

// Makes the distances of a block negative where the winding number is not 0, by rows of voxels along x. lowest: of its
// voxels. Returns whether any faces lie inside. crossings: space.
bool sign_by_windings(const RayCrossings& faces, const Eigen::Vector3i& lowest,
                      std::span<float, VoxelBlocks::voxels> distance, std::vector<RayCrossings::Crossing>& crossings);

}  // namespace rapid
