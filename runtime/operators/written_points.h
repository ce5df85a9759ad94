// Selects the points that a node passes to Evaluation::write.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "runtime/points/members.h"

namespace rapid {

// Returns the members of a group, or all points if it is empty.
inline PointSet members_alone(const PointSet& points, const std::string& group)
{
    PointSet set = points;
    if (group.empty()) return set;
    const Strided<std::uint8_t> members = members_of(set, group);
    std::vector<std::uint8_t> mask(set.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = members[i];
    set.keep(mask);
    return set;
}

// Removes all columns except P, v, id and the named ones.
inline void keep_columns(PointSet& set, const std::vector<std::string>& names)
{
    for (const std::string& name : set.column_names())
        if (name != "P" && name != "v" && name != "id" && std::find(names.begin(), names.end(), name) == names.end())
            set.remove(name);
}

}  // namespace rapid
