// OpenVDB with the kinds of grids that are used here. Their virtual functions are in its library: without the lines
// below each file that makes a grid compiles all of them again, eight seconds for each kind. What is not inlined is
// taken from the library, too, and it has what optimised code does not inline.
#pragma once

#include <openvdb/openvdb.h>

#ifdef __OPTIMIZE__
extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Vec3STree::RootNodeType>;
extern template class openvdb::Grid<openvdb::FloatTree>;
extern template class openvdb::Grid<openvdb::Int32Tree>;
extern template class openvdb::Grid<openvdb::Vec3STree>;
#endif
