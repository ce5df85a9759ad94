// OpenVDB's mesh distance, without a tree type that its header would compile in each file and that is unused here.
#pragma once

#include <openvdb/tools/MeshToVolume.h>

#include "runtime/base/openvdb_grids.h"

#ifdef RAPID_OPENVDB_IN_LIBRARY
extern template class openvdb::tree::Tree<
    openvdb::tree::Tree4<openvdb::tools::MeshToVoxelEdgeData::EdgeData, 5, 4, 3>::Type::RootNodeType>;
#endif
