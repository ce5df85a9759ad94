// Naming and selection of the grids in a .vdb file, for its readers.
#pragma once

#include <string>

#include "runtime/base/openvdb_grids.h"

namespace rapid {

// Returns a list for messages: `"density" (float), "surface" (level set of float)`.
std::string grids_of(const openvdb::GridPtrVec& grids);

// Throws Error if there is no such grid. The message lists the grids and suggests the nearest name.
openvdb::GridBase::Ptr grid_of_name(const std::string& path, const std::string& name, const openvdb::GridPtrVec& grids);

}  // namespace rapid
