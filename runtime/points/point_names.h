// The names of a point that are the same in every scene: its own columns, what scripts may ask of it besides
// attributes, and its methods. No attribute may take one. Scripts, their analysis and the editor's annotations read
// this table.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

struct PointName {
    enum Role {
        OwnColumn,  // of every set, or among Solve and the emitters (dt)
        Field,      // computed when it is asked for
        Method,
    };

    std::string_view name;
    Role role;
    bool read_only = false;                     // to scripts
    AttributeType type = AttributeType::Float;  // of a column or a field
    std::string_view doc = {};
};

inline constexpr PointName point_names[] = {
    {"P", PointName::OwnColumn, false, AttributeType::Vec3, "m"},
    {"v", PointName::OwnColumn, false, AttributeType::Vec3, "m/s"},
    {"id", PointName::OwnColumn, true, AttributeType::Int64},
    {"dt", PointName::OwnColumn, true, AttributeType::Float, "seconds that this point is advanced in this frame"},
    {"index", PointName::Field, true, AttributeType::Int64, "place in the set, from 1"},
    {"nage", PointName::Field, true, AttributeType::Float, "age as a part of life: from 0 at birth to 1 at the end"},
    {"join", PointName::Method},
    {"leave", PointName::Method},
    {"within", PointName::Method},
    {"kill", PointName::Method},
    {"rand", PointName::Method},
};

// Null for any other name, such as an attribute's.
constexpr const PointName* find_point_name(std::string_view name)
{
    for (const PointName& known : point_names)
        if (known.name == name) return &known;
    return nullptr;
}

constexpr bool is_own_column(std::string_view name)
{
    const PointName* known = find_point_name(name);
    return known && known->role == PointName::OwnColumn;
}

constexpr bool is_read_only(std::string_view name)
{
    const PointName* known = find_point_name(name);
    return known && known->read_only;
}

// Those of a role, in the order of the table.
std::vector<std::string> point_names_of(PointName::Role role);

}  // namespace rapid
