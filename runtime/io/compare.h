// How two point sets differ, point by point of the same id: what `rapid diff` prints.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// Which points of two sets have the same id: places a[i] and b[i] belong together, in order of id. Ids that occur more
// than once are matched in turn.
struct IdMatch {
    std::vector<std::size_t> a, b;
    std::vector<std::int64_t> only_a, only_b;  // ids
};
IdMatch match_by_id(const PointSet& a, const PointSet& b);

// Over the points that are in both sets. A value's difference is the length of the difference vector (of scalars: its
// amount); NaN differs by 0 from NaN, and infinitely from everything else.
struct AttributeDifference {
    std::string name;
    std::string type_a, type_b;  // empty: not in that set
    double max = 0, rms = 0, p95 = 0;
    std::int64_t worst_id = -1;  // the point with the largest difference; -1 where there is none
    std::size_t different = 0;   // points beyond the tolerance
    bool same = true;
};

struct Comparison {
    std::size_t points_a = 0, points_b = 0, compared = 0;
    std::vector<std::int64_t> only_a, only_b;  // ids
    double tolerance = 0;
    double tolerance_P = 0;                       // m
    std::vector<AttributeDifference> attributes;  // P, v and the others by name
    std::vector<AttributeDifference> groups;      // `different` counts; a missing group is an empty one
    bool same = true;
};

// P is the same within `tolerance` times the diagonal of the bounds of both sets, other floats within `tolerance` times
// the larger of the two values (of vectors: of their lengths); integers and groups only when equal. An integer and a
// float attribute are compared by value: .csv does not say which it holds. An attribute that one set alone has is a
// difference, unless there are no points.
Comparison compare(const PointSet& a, const PointSet& b, double tolerance = 1e-6);
std::string to_text(const Comparison& comparison);
nlohmann::ordered_json to_json(const Comparison& comparison);

}  // namespace rapid
