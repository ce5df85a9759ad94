// The points of the parts of a run as one set.
#pragma once

#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// parts: number k + 1 of all parts at k, whose points are in order of id. In order of id, as the whole run has them.
// Columns must be of the same names; of the same types, too, but that whole numbers become floats, or longer, where a
// text file has told no better. names: of the parts, for errors. Error: a point that belongs to another part; columns
// that differ; points out of order.
PointSet merge_parts(const std::vector<PointSet>& parts, const std::vector<std::string>& names);

}  // namespace rapid
