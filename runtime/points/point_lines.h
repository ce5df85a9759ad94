// Lines through points, as files hold them: of a set with trails (trail.h) each point's, from the point itself
// backwards through its places of earlier frames; else, of a set with the int `curve`, a line through each run of
// points of the same value from 0 on.
//
// The places of trails become points behind those of the set, which have all attributes of their own point and are
// members of the group `trail_places`: readers take them for what they are.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

constexpr const char* trail_places_group = "trail_places";
constexpr const char* curve_attribute = "curve";  // the number of a point's line, below 0 of none

struct PointLines {
    PointSet points;
    std::vector<std::uint32_t> vertices;  // of all lines, one after the other: places in `points`
    std::vector<std::uint32_t> sizes;     // vertices of each line, two or more
};

PointLines with_lines(const PointSet& points);

// The set that with_lines() was given, of its points.
PointSet without_trail_places(PointSet points);

// Puts the vertices of lines in the order of these, each with the number of its line as `curve`, and behind them the
// points of no line with -1. A point that several lines share is there for each. Without lines: the points.
PointSet in_order_of_lines(const PointLines& lines);

}  // namespace rapid
