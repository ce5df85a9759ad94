// Naming and selection of the grids in a .vdb file, for its readers.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "runtime/base/error.h"
#include "runtime/base/openvdb_grids.h"
#include "runtime/files/read_sandboxed.h"

namespace rapid {

// Returns a list for messages: `"density" (float), "surface" (level set of float)`.
std::string grids_of(const openvdb::GridPtrVec& grids);

// Throws Error if there is no such grid. The message lists the grids and suggests the nearest name.
openvdb::GridBase::Ptr grid_of_name(const std::string& path, const std::string& name, const openvdb::GridPtrVec& grids);

// Grids in messages between processes (files/read_sandboxed.h): the tree's tiles and leaves, its map if that is linear,
// its class and background. The receiver checks them: values must be finite, and the grid must fit the tables that are
// built from it.
inline bool is_finite(float value) { return std::isfinite(value); }
inline bool is_finite(const openvdb::Vec3s& value) { return value.isFinite(); }

// Returns true if the map is a translation and a positive uniform scale.
bool is_uniform(const openvdb::Mat4R& map);
bool is_uniform(const openvdb::math::Transform& transform);

// Throws Error if the map has no inverse.
openvdb::math::Transform::Ptr transform_of(const openvdb::Mat4R& map, const std::string& name);

// Throws Error if the 8^3 boxes around all leaves exceed the index of a level set.
void check_extent(const openvdb::CoordBBox& leaves, const std::string& name);

template <class Grid>
void send_grid(const typename Grid::Ptr& grid, MessageWriter& message)
{
    using Tree = typename Grid::TreeType;
    using Value = typename Grid::ValueType;
    if (!grid->transform().isLinear())
        throw Error(fmt::format(
            "the transform of grid \"{}\" is not linear; resample the grid to voxels along the axes", grid->getName()));
    const openvdb::Mat4R map = grid->transform().baseMap()->getAffineMap()->getMat4();
    message.put_text(grid->getName());
    message.put(static_cast<std::int32_t>(grid->getGridClass()));
    message.put_array(std::span<const double>(map.asPointer(), 16));
    message.put(grid->background());

    auto tiles = grid->tree().cbeginValueAll();
    tiles.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tiles; ++tiles) {
        if (!tiles.isValueOn() && *tiles == grid->background()) continue;
        openvdb::CoordBBox box;
        tiles.getBoundingBox(box);
        message.put<std::uint8_t>(static_cast<std::uint8_t>(tiles.getLevel()));
        message.put<std::uint8_t>(tiles.isValueOn());
        message.put(box.min().asVec3i());
        message.put<Value>(*tiles);
    }
    message.put<std::uint8_t>(0);  // level 0 ends the tiles
    message.put<std::size_t>(grid->tree().leafCount());
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
        message.put(leaf->origin().asVec3i());
        for (openvdb::Index word = 0; word < Tree::LeafNodeType::NodeMaskType::WORD_COUNT; ++word)
            message.put(leaf->valueMask().template getWord<openvdb::Index64>(word));
        message.put_array(std::span<const Value>(leaf->buffer().data(), Tree::LeafNodeType::SIZE));
    }
}

template <class Grid>
typename Grid::Ptr receive_grid(MessageReader& message)
{
    using Leaf = typename Grid::TreeType::LeafNodeType;
    using Value = typename Grid::ValueType;
    const std::string name = message.take_text();
    const auto grid_class = message.take<std::int32_t>();
    openvdb::Mat4R map;
    message.take_array(std::span<double>(map.asPointer(), 16));

    const auto grid = Grid::create(message.take<Value>());
    grid->setName(name);
    grid->setGridClass(static_cast<openvdb::GridClass>(grid_class));
    grid->setTransform(transform_of(map, name));

    const auto check_value = [&](const Value& value, const openvdb::Coord& at) {
        if (!is_finite(value))
            throw Error(fmt::format("grid \"{}\" has a value that is not finite, at voxel {} {} {}", name, at.x(),
                                    at.y(), at.z()));
    };
    while (const auto level = message.take<std::uint8_t>()) {
        if (level >= Grid::TreeType::DEPTH) throw Error("the reader failed, so it must be damaged");
        const bool on = message.take<std::uint8_t>() != 0;
        const openvdb::Coord origin(message.take<openvdb::Vec3i>());
        const auto value = message.take<Value>();
        check_value(value, origin);
        grid->tree().addTile(level, origin, value, on);
    }
    openvdb::CoordBBox bounds;
    for (auto leaves = message.take<std::size_t>(); leaves > 0; --leaves) {
        message.check_left(1, Leaf::SIZE * sizeof(Value));
        Leaf& leaf = *grid->tree().touchLeaf(openvdb::Coord(message.take<openvdb::Vec3i>()));
        bounds.expand(leaf.origin());
        for (openvdb::Index word = 0; word < Leaf::NodeMaskType::WORD_COUNT; ++word)
            leaf.getValueMask().template getWord<openvdb::Index64>(word) = message.take<openvdb::Index64>();
        message.take_array(std::span<Value>(leaf.buffer().data(), Leaf::SIZE));
        for (openvdb::Index i = 0; i < Leaf::SIZE; ++i)
            check_value(leaf.buffer().data()[i], leaf.offsetToGlobalCoord(i));
    }
    check_extent(bounds, name);
    return grid;
}

// Reads a grid in another process. Adds the file's name to errors.
template <class Grid>
typename Grid::Ptr read_grid_sandboxed(const SandboxedReader<typename Grid::Ptr>& reader,
                                       const std::filesystem::path& path, const std::string& name)
{
    try {
        return reader(path, name);
    } catch (Error& error) {
        if (error.message().find(path.string()) != std::string::npos) throw;
        throw Error(fmt::format("cannot read \"{}\": {}", path.string(), error.message()), error.kind());
    }
}

// Returns a grid under another name that shares the tree. Throws Error if the name is empty.
template <class Grid>
openvdb::GridBase::ConstPtr named_grid(const Grid& grid, const std::string& name)
{
    openvdb::MetaMap metadata(grid);
    metadata.removeMeta(openvdb::GridBase::META_GRID_NAME);
    metadata.insertMeta(openvdb::GridBase::META_GRID_NAME, openvdb::StringMetadata(name));
    return grid.copyGridReplacingMetadata(metadata);
}

// Throws Error if the file cannot be written or a grid has no name.
void write_archive(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids);

}  // namespace rapid
