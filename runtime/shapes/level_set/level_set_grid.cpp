#include "runtime/shapes/level_set/level_set_grid.h"

#include <fmt/format.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetRebuild.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/level_set_tools.h"
#include "runtime/shapes/level_set/openvdb_meshes.h"
#include "runtime/shapes/level_set/placed.h"
#include "runtime/shapes/level_set/voxel_blocks.h"

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

// Bakes the tree of an OpenVDB level set for queries.
BakedGrid bake(const openvdb::FloatGrid& grid)
{
    using Accessor = openvdb::tree::ValueAccessor<const openvdb::FloatTree, /*registered with the tree*/ false>;
    BlockTable blocks{{}, grid.voxelSize()[0], grid.background(), {}, {}};
    openvdb::CoordBBox leaves;
    if (grid.tree().evalLeafBoundingBox(leaves)) {
        const auto coord = [](const openvdb::Coord& c) {
            return BlockTable::BlockCoord(c.x() >> 3, c.y() >> 3, c.z() >> 3);
        };
        blocks.with_values = {coord(leaves.min()), coord(leaves.max())};
    }
    blocks.to_world = [&](const Vec3d& P) {
        const auto there = grid.indexToWorld(openvdb::Vec3d(P.x(), P.y(), P.z()));
        return Vec3d(there[0], there[1], there[2]);
    };
    blocks.reader = [&] {
        return [accessor = std::make_shared<const Accessor>(grid.tree())](const BlockTable::BlockCoord& coord) {
            const openvdb::Coord lowest(8 * coord.x(), 8 * coord.y(), 8 * coord.z());
            if (const auto* leaf = accessor->probeConstLeaf(lowest)) return BlockValues{leaf->buffer().data(), 0};
            return BlockValues{nullptr, accessor->getValue(lowest)};
        };
    };
    return bake(blocks);
}

// Resamples level sets to other voxels through a mesh of their surface, which restores exact distances.

namespace {

using openvdb::FloatGrid;

// Estimates the area of the surface, m². The band has voxels on both sides of it.
double area_of(const FloatGrid& grid)
{
    return double(grid.activeVoxelCount()) * std::pow(grid.voxelSize()[0], 3) / (2 * grid.background());
}

// Returns the grid of a level set, including its rotation.
FloatGrid::ConstPtr grid_in_world(const LevelSetPtr& shape)
{
    if (const auto grid = std::dynamic_pointer_cast<const BakedLevelSet>(shape)) return grid->grid()->grid;
    const auto& turned = dynamic_cast<const PlacedLevelSet&>(*shape);
    const FloatGrid::ConstPtr rest = grid_in_world(turned.rest());
    const Eigen::Matrix4d pose = turned.pose().affine().matrix();
    openvdb::Mat4R map;  // OpenVDB uses row vectors
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) map(j, i) = pose(i, j);
    const openvdb::Mat4R to_world = rest->transform().baseMap()->getAffineMap()->getMat4() * map;
    return openvdb::gridConstPtrCast<FloatGrid>(
        rest->copyGridReplacingTransform(openvdb::math::Transform::createLinearTransform(to_world)));
}

}  // namespace

FloatGrid::Ptr widened(const FloatGrid& grid, double half_width)
{
    const double voxel = grid.voxelSize()[0];
    const auto index = grid.evalActiveVoxelBoundingBox();
    const auto low = grid.indexToWorld(index.min()), high = grid.indexToWorld(index.max());
    require_buildable(fmt::format("grid \"{}\"", grid.getName()), area_of(grid),
                      Box3d(Vec3d(low[0], low[1], low[2]), Vec3d(high[0], high[1], high[2])),
                      {voxel, half_width / voxel});
    auto wide = openvdb::tools::levelSetRebuild(grid, 0.0f, static_cast<float>(half_width / voxel));
    openvdb::tools::compReplace(*wide, grid);
    wide->setName(grid.getName());
    return wide;
}

FloatGrid::Ptr on_cubic_voxels(const FloatGrid& grid)
{
    const double voxel = std::min({grid.voxelSize()[0], grid.voxelSize()[1], grid.voxelSize()[2]});
    constexpr double half_width = 3;
    Box3d bounds;
    const auto index = grid.evalActiveVoxelBoundingBox();
    for (int corner = 0; corner < 8; ++corner) {
        const openvdb::Vec3d P = grid.indexToWorld(openvdb::Coord(corner & 1 ? index.max().x() : index.min().x(),
                                                                  corner & 2 ? index.max().y() : index.min().y(),
                                                                  corner & 4 ? index.max().z() : index.min().z()));
        bounds.extend(Vec3d(P.x(), P.y(), P.z()));
    }
    const double volume = std::abs(grid.transform().baseMap()->determinant());
    require_buildable(fmt::format("grid \"{}\"", grid.getName()),
                      double(grid.activeVoxelCount()) * volume / (2 * half_width * voxel), bounds, {voxel, half_width});
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    auto cubic = openvdb::tools::levelSetRebuild(grid, 0.0f, static_cast<float>(half_width), transform.get());
    cubic->setName(grid.getName());
    SkippedContents::note(
        fmt::format("the voxels of grid \"{}\" are not cubes along the axes; it is resampled to cubes of {:g} m",
                    grid.getName(), voxel));
    return cubic;
}

FloatGrid::Ptr resampled_to(const LevelSetPtr& shape, const openvdb::math::Transform& transform, double half_width)
{
    const double voxel = transform.voxelSize()[0];
    const FloatGrid::ConstPtr source = grid_in_world(shape);
    require_buildable("the resampled level set", area_of(*source), shape->bounds(), {voxel, half_width / voxel});
    auto grid = openvdb::tools::levelSetRebuild(*source, 0.0f, static_cast<float>(half_width / voxel), &transform);
    grid->setName("surface");
    return grid;
}

namespace {

LevelSetPtr resampled(const LevelSetPtr& shape, double voxel)
{
    const double half_width = shape->band() / shape->voxel();
    require_legal({voxel, half_width});
    const Vec3f size = shape->surface()->bounds().sizes();
    if (size.minCoeff() < voxel)
        throw Error(fmt::format(
            "the level set vanishes with voxel = {:g} m: its size is {:.3g} x {:.3g} x {:.3g} m; use a voxel "
            "of at most {:.3g} m",
            voxel, size.x(), size.y(), size.z(), size.minCoeff() / 3));
    // Gives our own error before OpenVDB refuses the voxel size.
    require_buildable("the resampled level set", area_of(*grid_in_world(shape)), shape->bounds(), {voxel, half_width});
    const auto transform = transform_of(frame_around(shape->bounds(), voxel));
    const auto build = [=](double metres) { return resampled_to(shape, *transform, metres); };
    return level_set_of(build(half_width * voxel), build);
}

RAPID_DEFINE(resample_level_set, resampled);

}  // namespace

}  // namespace rapid
