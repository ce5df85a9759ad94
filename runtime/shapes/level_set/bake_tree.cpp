// Bakes the tree of an OpenVDB level set for queries.
#include <memory>

#include "runtime/shapes/level_set/bake.h"
#include "runtime/shapes/level_set/level_set_grid.h"

namespace rapid {

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

}  // namespace rapid
