// The names of a point that exist in every scene: its built-in columns, computed fields and methods. No attribute may
// use one. Scripts, their analysis and the editor's annotations read this table.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

struct PointName {
    enum Role {
        OwnColumn,  // in every set, or (dt) between the emitters and Solve
        Field,      // computed on access
        Method,
    };

    std::string_view name;
    Role role;
    bool read_only = false;                     // for scripts
    AttributeType type = AttributeType::Float;  // of a column or field
    std::string_view doc = {};
};

inline constexpr PointName point_names[] = {
    {"P", PointName::OwnColumn, false, AttributeType::Vec3, "m"},
    {"v", PointName::OwnColumn, false, AttributeType::Vec3, "m/s"},
    {"id", PointName::OwnColumn, true, AttributeType::Int64},
    {"dt", PointName::OwnColumn, true, AttributeType::Float, "time that the point moves in this frame, s"},
    {"index", PointName::Field, true, AttributeType::Int64, "index in the set, from 1"},
    {"nage", PointName::Field, true, AttributeType::Float, "age / life: 0 at birth, 1 at death"},
    {"join", PointName::Method},
    {"leave", PointName::Method},
    {"within", PointName::Method},
    {"kill", PointName::Method},
    {"rand", PointName::Method},
};

// Returns null for any other name, such as that of an attribute.
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

// Returns the names with this role, in table order.
std::vector<std::string> point_names_of(PointName::Role role);

}  // namespace rapid
