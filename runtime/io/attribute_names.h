// Names of attributes in files whose columns are scalars (.csv, .ply): a vec3 is NAMEx NAMEy NAMEz, a quaternion NAMEx
// NAMEy NAMEz NAMEw. A group is a separate column, named group_NAME in files of arrays and channels.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

inline constexpr std::string_view group_prefix = "group_";
inline constexpr std::size_t max_numbers = 16;  // per point in an array; larger arrays are not read as attributes

// Returns the number of components of the type: 1, 3 or 4.
std::size_t component_count(AttributeType type);
std::vector<std::string> component_names(std::string_view name, std::size_t count);

// Columns of a file that form one attribute: consecutive NAMEx NAMEy NAMEz (NAMEw).
struct JoinedColumns {
    std::string name;
    std::vector<std::size_t> columns;
};
std::vector<JoinedColumns> join_components(std::span<const std::string> names);

// Throws Error if a name is duplicated (attributes "P" and "Px" in one set), empty, or has a `forbidden` character.
void check_column_names(std::span<const std::string> names, std::string_view forbidden);

// Returns the names of all columns except P, v and id, sorted.
std::vector<std::string> further_attributes(const PointSet& points);

}  // namespace rapid
