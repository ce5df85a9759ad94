// Merges the parts of a run into one set.
#pragma once

#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// Returns all points in order of id, as in the whole run. parts[k] is part number k + 1, with points in order of id.
// All parts must have the same columns with the same types. If text files have lost the types, integers are converted
// to floats or to wider integers. names: of the parts, for errors. Throws Error if a point belongs to another part, if
// columns differ, or if points are out of order.
PointSet merge_parts(const std::vector<PointSet>& parts, const std::vector<std::string>& names);

}  // namespace rapid
