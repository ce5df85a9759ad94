// OpenVDB with extern template declarations of the grid types used here. Their virtual functions are in its library;
// without the lines below, each file that creates a grid would compile all of them again, eight seconds per type.
// Functions that are not inlined come from the library, too. It has all that g++ does not inline when it optimises.
// Sanitizers, and clang with them, inline less and call functions that it lacks.
#pragma once

#include <openvdb/openvdb.h>

#if defined(__OPTIMIZE__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define RAPID_OPENVDB_IN_LIBRARY
#endif

#ifdef RAPID_OPENVDB_IN_LIBRARY
extern template class openvdb::tree::Tree<openvdb::FloatTree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Int32Tree::RootNodeType>;
extern template class openvdb::tree::Tree<openvdb::Vec3STree::RootNodeType>;
extern template class openvdb::Grid<openvdb::FloatTree>;
extern template class openvdb::Grid<openvdb::Int32Tree>;
extern template class openvdb::Grid<openvdb::Vec3STree>;
#endif
