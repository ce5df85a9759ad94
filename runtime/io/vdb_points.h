// OpenVDB's grids of points, as runtime/openvdb_grids.h has those of values.
#pragma once

#include <openvdb/points/PointDataGrid.h>

#include "runtime/openvdb_grids.h"

#ifdef RAPID_OPENVDB_IN_LIBRARY
extern template class openvdb::tree::Tree<openvdb::points::PointDataTree::RootNodeType>;
extern template class openvdb::Grid<openvdb::points::PointDataTree>;
#endif
