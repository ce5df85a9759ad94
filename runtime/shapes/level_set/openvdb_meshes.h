// OpenVDB's distance from a mesh, without a tree that its header compiles in each file and that nobody here uses.
#pragma once

#include <openvdb/tools/MeshToVolume.h>

#include "runtime/openvdb_grids.h"

#ifdef RAPID_OPENVDB_IN_LIBRARY
extern template class openvdb::tree::Tree<
    openvdb::tree::Tree4<openvdb::tools::MeshToVoxelEdgeData::EdgeData, 5, 4, 3>::Type::RootNodeType>;
#endif
