// Points in order of their ids: the order that does not depend on a file format or on what was removed.
#pragma once

#include <cstddef>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// The place of each point in order of id (equal ids keep their order), shape [size]; empty where that is the order
// already.
std::vector<std::size_t> id_order(const Column<std::int64_t>& id);

// The points at these places, shape [order]; all of them, as they are, where it is empty.
PointSet reordered(const PointSet& points, const std::vector<std::size_t>& order);

}  // namespace rapid
