// Membership of a group, for code that acts only on its members.
#pragma once

#include <string_view>

#include "runtime/points/point_set.h"

namespace rapid {

// Returns 1 for each member, else 0. An empty name selects all points; a group that does not exist has no members.
// Valid until the group is written or moved.
Strided<std::uint8_t> members_of(const PointSet& points, std::string_view group);

}  // namespace rapid
