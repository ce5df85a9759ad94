#include "runtime/shapes/level_set/mesh_blocks.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "runtime/base/parallel.h"
#include "runtime/shapes/level_set/mesh_band.h"

namespace rapid {

static_assert(MeshBand::block == VoxelBlocks::edge && MeshBand::voxels == VoxelBlocks::voxels);

MeshPtr in_voxels(const Mesh& mesh, const VoxelFrame& frame)
{
    auto result = std::make_shared<Mesh>();
    result->triangles = mesh.triangles;
    result->positions.reserve(mesh.positions.size());
    for (const Vec3f& P : mesh.positions) result->positions.push_back(frame.to_voxels(P.cast<double>()).cast<float>());
    return result;
}

bool sign_by_windings(const RayCrossings& faces, const Eigen::Vector3i& lowest,
                      std::span<float, VoxelBlocks::voxels> distance, std::vector<RayCrossings::Crossing>& crossings)
{
    constexpr int edge = VoxelBlocks::edge;
    bool overlap = false;
    for (int y = 0; y < edge; ++y)
        for (int z = 0; z < edge; ++z) {
            faces.along_x(lowest.y() + y, lowest.z() + z, crossings);
            int windings = 0;
            auto beyond = crossings.rbegin();
            for (int x = edge - 1; x >= 0; --x) {
                for (; beyond != crossings.rend() && beyond->x > lowest.x() + x; ++beyond) {
                    overlap = overlap || (windings != 0 && windings + beyond->turn != 0);
                    windings += beyond->turn;
                }
                float& value = distance[(x * edge + y) * edge + z];
                value = std::copysign(value, windings != 0 ? -1.0f : 1.0f);
            }
        }
    return overlap;
}

MeshBlocks measure(const Mesh& mesh, const VoxelFrame& frame, double half_width)
{
    constexpr std::size_t part = 8, voxels = VoxelBlocks::voxels;
    MeshBlocks result{in_voxels(mesh, frame), {frame, half_width, {}, {}, {}}, {}};
    VoxelBlocks& blocks = result.blocks;
    const MeshBand band(*result.mesh, half_width / frame.voxel);
    blocks.resize(band.size());
    result.nearest.resize(band.size() * voxels);
    const auto nearest = [&](std::size_t b) {
        return std::span<std::int32_t, voxels>(result.nearest.data() + b * voxels, voxels);
    };
    for_each_chunk(
        band.size(),
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b) {
                const std::span<float, voxels> values = blocks.of(b);
                blocks.coords[b] = band.origin(b) / VoxelBlocks::edge;
                band.measure(b, values, nearest(b));
                for (std::size_t v = 0; v < voxels; ++v) {
                    const bool is_near = nearest(b)[v] >= 0;
                    values[v] = is_near ? values[v] * static_cast<float>(frame.voxel) : blocks.background();
                    if (is_near) VoxelBlocks::mark(blocks.in_band[b], v);
                }
            }
        },
        part);
    blocks.drop_empty(
        [&](std::size_t from, std::size_t to) { std::copy_n(nearest(from).begin(), voxels, nearest(to).begin()); });
    result.nearest.resize(blocks.size() * voxels);

    const RayCrossings faces(result.mesh);
    std::atomic<bool> overlap = false;
    for_each_chunk(
        blocks.size(),
        [&](std::size_t begin, std::size_t end) {
            std::vector<RayCrossings::Crossing> crossings;
            for (std::size_t b = begin; b < end; ++b)
                if (sign_by_windings(faces, VoxelBlocks::edge * blocks.coords[b], blocks.of(b), crossings))
                    overlap = true;
        },
        part);
    result.overlap = overlap;
    return result;
}

}  // namespace rapid
