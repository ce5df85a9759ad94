// Names of attributes in files whose columns are scalars (.csv, .ply): a vec3 is NAMEx NAMEy NAMEz, a quaternion NAMEx
// NAMEy NAMEz NAMEw. A group is a column of its own, in files of arrays and channels group_NAME.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

inline constexpr std::string_view group_prefix = "group_";
inline constexpr std::size_t most_numbers = 16;  // of a point in an array; arrays of more are no attributes

// The number of components of the type: 1, 3 or 4.
std::size_t component_count(AttributeType type);
std::vector<std::string> component_names(std::string_view name, std::size_t count);

// The columns of a file joined to attributes: consecutive NAMEx NAMEy NAMEz (NAMEw) are one.
struct JoinedColumns {
    std::string name;
    std::vector<std::size_t> columns;
};
std::vector<JoinedColumns> join_components(std::span<const std::string> names);

// Error: a duplicate name (attributes "P" and "Px" in one set), an empty one, or one with a `forbidden` character.
void check_column_names(std::span<const std::string> names, std::string_view forbidden);

// The columns of the points except P, v and id, in order of name.
std::vector<std::string> further_attributes(const PointSet& points);

}  // namespace rapid
