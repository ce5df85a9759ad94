// Selects the attributes that a file will contain.
#pragma once

#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// Returns the points with only P, v, id and the named attributes and groups. Throws Error if a name is unknown,
// suggesting the nearest.
PointSet select_attributes(const PointSet& points, const std::vector<std::string>& names);

}  // namespace rapid
