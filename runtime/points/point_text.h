// Describes a point in messages, with the values that help a scene's author find out what went wrong.
#pragma once

#include <string>

#include "runtime/points/point_set.h"

namespace rapid {

// Returns all attributes except id and dt, and the groups: P = {0, 1, 0}, v = {0, -3, 0}, heat = 1, in "hot"
std::string text_of_point(const PointSet& points, std::size_t i);

}  // namespace rapid
