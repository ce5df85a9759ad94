// Writes grids to .vdb files, which get their names only when they are complete.
#pragma once

#include <filesystem>
#include <string>

#include "runtime/base/openvdb_grids.h"

namespace rapid {

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
