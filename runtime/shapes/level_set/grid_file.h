// For readers of .vdb files: how the grids in a file are named and chosen.
#pragma once

#include <string>

#include "runtime/openvdb_grids.h"

namespace rapid {

// `"density" (float), "surface" (level set of float)`.
std::string grids_of(const openvdb::GridPtrVec& grids);

// Error: no such grid; lists those that there are, and the nearest name.
openvdb::GridBase::Ptr grid_of_name(const std::string& path, const std::string& name, const openvdb::GridPtrVec& grids);

}  // namespace rapid
