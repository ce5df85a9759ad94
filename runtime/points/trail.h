// Trails: the previous positions of each point, in columns of its set.
//
// trail1 is the position one frame ago, trail2 two frames ago, and so on. trailnum is the number of positions recorded
// so far. Columns are shifted as a whole: a frame copies pointers instead of positions.
#pragma once

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

}  // namespace rapid
