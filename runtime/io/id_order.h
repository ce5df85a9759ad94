// Points in order of id, which depends neither on a file format nor on removed points.
#pragma once

#include <cstddef>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// The indices of the points in order of id (stable), shape [size]; empty where they are in order already.
std::vector<std::size_t> id_order(const Column<std::int64_t>& id);

// The points with these indices, shape [order]; the set itself where it is empty.
PointSet reordered(const PointSet& points, const std::vector<std::size_t>& order);

}  // namespace rapid
