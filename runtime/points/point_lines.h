// Lines through points, as files store them. In a set with trails (trail.h) each point has a line from itself backwards
// through its earlier positions. Otherwise, if the set has the integer attribute `curve`, a line connects each run of
// consecutive points with the same value, which must not be negative.
//
// Trail positions become points after those of the set. They copy all attributes of their point and are in the group
// `trail_places`, by which readers recognise them.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

constexpr const char* trail_places_group = "trail_places";
constexpr const char* curve_attribute = "curve";  // line number of a point; negative if it is on no line

struct PointLines {
    PointSet points;
    std::vector<std::uint32_t> vertices;  // indices in `points`, line after line
    std::vector<std::uint32_t> sizes;     // vertices of each line, two or more
};

PointLines with_lines(const PointSet& points);

// Returns the set that was passed to with_lines(), from the points that it returned.
PointSet without_trail_places(PointSet points);

// Orders points by line and stores the line number as `curve`. Points on no line follow with -1. A point on several
// lines is repeated for each. Returns the points unchanged if there are no lines.
PointSet in_order_of_lines(const PointLines& lines);

}  // namespace rapid
