// Trails: the last places of each point, in columns of its set.
//
// trail1 is where a point was a frame before, trail2 two frames before, and so on; trailnum says how many of them it
// has had. The columns are moved on as wholes: a frame copies pointers, and no place twice.
#pragma once

#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

constexpr int most_trail_places = 256;

// "trail1".
std::string trail_name(int place);
constexpr const char* trail_count_name = "trailnum";

// What points with a trail of so many places have.
std::vector<AttributeSpec> trail_columns(int places);

// Reads the trails of a set; one without any has none.
class Trails {
public:
    explicit Trails(const PointSet& points);

    int places() const { return static_cast<int>(columns_.size()); }  // the most that a point has
    int count(std::size_t i) const;                                   // that this one has
    // From 0, the point itself, to count(i).
    const Vec3f& at(std::size_t i, int place) const { return place == 0 ? P_[i] : columns_[place - 1][i]; }

private:
    Strided<Vec3f> P_;
    std::vector<Strided<Vec3f>> columns_;
    const Column<std::int32_t>* count_;
};

}  // namespace rapid
