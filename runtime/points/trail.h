// Trails: the previous positions of each point, in columns of its set.
//
// trail1 is the position one frame ago, trail2 two frames ago, and so on. trailnum is the number of positions recorded
// so far. Columns are shifted as a whole: a frame copies pointers instead of positions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

constexpr int max_trail_places = 256;

// Returns "trail1", "trail2", ...
std::string trail_name(int place);
constexpr const char* trail_count_name = "trailnum";

// Returns the columns of points with trails of this many positions.
std::vector<AttributeSpec> trail_columns(int places);

// Reads the trails of a set. A set without trails has places() == 0.
class Trails {
public:
    explicit Trails(const PointSet& points);

    int places() const { return static_cast<int>(columns_.size()); }  // the most that a point can have
    int count(std::size_t i) const;                                   // recorded for point i
    // Returns a position: 0 is the point itself, count(i) the oldest.
    const Vec3f& at(std::size_t i, int place) const { return place == 0 ? P_[i] : columns_[place - 1][i]; }

private:
    Strided<Vec3f> P_;
    std::vector<Strided<Vec3f>> columns_;
    const Column<std::int32_t>* count_;
};

// Lines through points, as files store them. In a set with trails (trail.h) each point has a line from itself backwards
// through its earlier positions. Otherwise, if the set has the integer attribute `curve`, a line connects each run of
// consecutive points with the same value, which must not be negative.
//
// Trail positions become points after those of the set. They copy all attributes of their point and are in the group
// `trail_places`, by which readers recognise them.
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
