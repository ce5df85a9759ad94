// Conversions between Rapid's attribute types and OpenVDB's.
#pragma once

#include <openvdb/points/PointDataGrid.h>

#include <type_traits>

#include "runtime/base/openvdb_grids.h"
#include "runtime/math/vec.h"
#include "runtime/points/token.h"

// Declares OpenVDB's point grids as extern templates, like the value grids in runtime/base/openvdb_grids.h.
#ifdef RAPID_OPENVDB_IN_LIBRARY
extern template class openvdb::tree::Tree<openvdb::points::PointDataTree::RootNodeType>;
extern template class openvdb::Grid<openvdb::points::PointDataTree>;
#endif

namespace rapid {

// Registers OpenVDB's types. Must be called before any other use of OpenVDB.
inline void initialize_openvdb()
{
    static const bool done = (openvdb::initialize(), true);
    (void)done;
}

// OpenVDB's type for Rapid's type T, with the same layout.
template <class T>
struct VdbValue {
    using Type = T;
    static const T& from(const T& value) { return value; }
};
template <>
struct VdbValue<Vec3f> {
    using Type = openvdb::Vec3s;
    static Type from(const Vec3f& value) { return {value.x(), value.y(), value.z()}; }
};
template <>
struct VdbValue<Quatf> {
    using Type = openvdb::math::Quat<float>;
    static Type from(const Quatf& value) { return {value.x(), value.y(), value.z(), value.w()}; }
};

// A string is its number among those of the grid, from 1; 0 is the empty string.
template <>
struct VdbValue<Token> {
    using Type = openvdb::Index;
};

// Converts an OpenVDB value of any precision to Rapid's.
template <class T, class Value>
T rapid_value(const Value& value)
{
    if constexpr (std::is_same_v<T, Vec3f>)
        return Vec3f(static_cast<float>(value[0]), static_cast<float>(value[1]), static_cast<float>(value[2]));
    else if constexpr (std::is_same_v<T, Quatf>)
        return Quatf(static_cast<float>(value[3]), static_cast<float>(value[0]), static_cast<float>(value[1]),
                     static_cast<float>(value[2]));
    else
        return static_cast<T>(value);
}

}  // namespace rapid
