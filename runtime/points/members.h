// Who is in a group, for those that act on its members alone.
#pragma once

#include <string_view>

#include "runtime/points/point_set.h"

namespace rapid {

// 1 for each member, else 0: of all points where the name is empty, of none where nothing has made the group. Valid
// until the group is written or moved.
Strided<std::uint8_t> members_of(const PointSet& points, std::string_view group);

}  // namespace rapid
