// Orders points by id, which depends neither on a file format nor on removed points.
#pragma once

#include <cstddef>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// Returns the indices of the points in order of id (stable), shape [size]; empty if they are already in order.
std::vector<std::size_t> id_order(const Column<std::int64_t>& id);

// Returns the points with these indices, shape [order], or the set itself if `order` is empty.
PointSet reordered(const PointSet& points, const std::vector<std::size_t>& order);

}  // namespace rapid
