// The part of the points that a file is to hold.
#pragma once

#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// The points with only P, v, id and the named attributes and groups. Error: an unknown name, with the nearest.
PointSet select_attributes(const PointSet& points, const std::vector<std::string>& names);

}  // namespace rapid
