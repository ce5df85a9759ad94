// Which points a node acts on: those of its group for which its `where` is true.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "runtime/graph/point_function.h"

namespace rapid {

// 1 for each point of `group` (all when it is empty) for which `where` is true (all when it is null), else 0; shape
// [size]. `where` is asked only about points of the group.
std::vector<std::uint8_t> select(const PointSet& points, std::string_view group, const PointFunction* where,
                                 const Evaluation& now);

}  // namespace rapid
