#include "runtime/shapes/level_set/level_set_grid.h"

#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

namespace rapid {

void initialize_openvdb()
{
    static const bool once = (openvdb::initialize(), true);
    static_cast<void>(once);
}

openvdb::math::Transform::Ptr transform_of(const VoxelFrame& frame)
{
    auto transform = openvdb::math::Transform::createLinearTransform(frame.voxel);
    if (!frame.origin.isZero(0)) transform->postTranslate({frame.origin.x(), frame.origin.y(), frame.origin.z()});
    return transform;
}

BakedPtr level_set_of(openvdb::FloatGrid::ConstPtr grid, RebuildGrid rebuild)
{
    const auto shared = std::make_shared<const LevelSetGrid>(LevelSetGrid{std::move(grid)});
    return level_set_of_grid(shared, [rebuild = std::move(rebuild)](double half_width) {
        return level_set_of(rebuild(half_width), rebuild);
    });
}

openvdb::FloatGrid::Ptr tree_of(const VoxelBlocks& blocks)
{
    using Leaf = openvdb::FloatTree::LeafNodeType;
    static_assert(VoxelBlocks::edge == Leaf::DIM && VoxelBlocks::voxels == Leaf::SIZE);
    auto grid = openvdb::FloatGrid::create(blocks.background());
    grid->setTransform(transform_of(blocks.frame));
    std::vector<std::unique_ptr<Leaf>> leaves(blocks.size());
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t b) {
        const VoxelBlocks::BlockCoord lowest = VoxelBlocks::edge * blocks.coords[b];
        leaves[b] = std::make_unique<Leaf>(openvdb::Coord(lowest.x(), lowest.y(), lowest.z()), blocks.background());
        std::ranges::copy(blocks.of(b), leaves[b]->buffer().data());
        for (std::size_t word = 0; word < blocks.in_band[b].size(); ++word)
            leaves[b]->getValueMask().getWord<openvdb::Index64>(static_cast<openvdb::Index>(word)) =
                blocks.in_band[b][word];
    });
    for (auto& leaf : leaves) grid->tree().addLeaf(leaf.release());
    return grid;
}

LevelSetGridPtr level_set_grid(const openvdb::FloatGrid::Ptr& grid)
{
    openvdb::tools::signedFloodFill(grid->tree());
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setName("surface");
    return std::make_shared<const LevelSetGrid>(LevelSetGrid{grid});
}

namespace {

LevelSetGridPtr from_blocks(const VoxelBlocks& blocks)
{
    initialize_openvdb();
    return level_set_grid(tree_of(blocks));
}

std::shared_ptr<const BakedLevelSet> from_grid(const LevelSetGridPtr& grid, std::function<LevelSetPtr(double)> rebuild)
{
    return std::make_shared<BakedLevelSet>(bake(*grid->grid), grid->grid->activeVoxelCount(),
                                           BakedLevelSet::Source{[grid] { return grid; }, std::move(rebuild)});
}

MeshPtr surface_of(const LevelSetGrid& grid)
{
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(*grid.grid, points, quads, 0.0);
    auto mesh = std::make_shared<Mesh>();
    mesh->name = "level set";
    for (const openvdb::Vec3s& P : points) mesh->positions.emplace_back(P.x(), P.y(), P.z());
    for (const openvdb::Vec4I& quad : quads) {  // clockwise seen from outside
        const Eigen::Vector4i q(quad[0], quad[1], quad[2], quad[3]);
        mesh->triangles.push_back({q[0], q[2], q[1]});
        mesh->triangles.push_back({q[0], q[3], q[2]});
    }
    return mesh;
}

RAPID_DEFINE(grid_of_blocks, from_blocks);
RAPID_DEFINE(level_set_of_grid, from_grid);
RAPID_DEFINE(surface_of_grid, surface_of);

}  // namespace
}  // namespace rapid
