// A point in words, for messages: what a graph's author looks for when one goes wrong.
#pragma once

#include <string>

#include "runtime/points/point_set.h"

namespace rapid {

// P = {0, 1, 0}, v = {0, -3, 0}, heat = 1, in "hot"        all attributes but id and dt, and its groups
std::string text_of_point(const PointSet& points, std::size_t i);

}  // namespace rapid
