// Declares OpenVDB's point grids as extern templates, like the value grids in runtime/base/openvdb_grids.h.
#pragma once

#include <openvdb/points/PointDataGrid.h>

#include "runtime/base/openvdb_grids.h"

#ifdef RAPID_OPENVDB_IN_LIBRARY
extern template class openvdb::tree::Tree<openvdb::points::PointDataTree::RootNodeType>;
extern template class openvdb::Grid<openvdb::points::PointDataTree>;
#endif
