// Compares two point sets by id, for `rapid diff`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

// The points of two sets with the same id: a[i] and b[i] are the indices of a pair, in order of id. Repeated ids are
// matched in order.
struct IdMatch {
    std::vector<std::size_t> a, b;
    std::vector<std::int64_t> only_a, only_b;  // ids without a match
};
IdMatch match_by_id(const PointSet& a, const PointSet& b);

// Differences of an attribute over the points in both sets. A difference is the norm of the difference vector, or the
// absolute value of a scalar difference. NaN differs by 0 from NaN, and infinitely from everything else.
struct AttributeDifference {
    std::string name;
    std::string type_a, type_b;  // empty if the set lacks it
    double max = 0, rms = 0, p95 = 0;
    std::int64_t worst_id = -1;  // the point with the largest difference; -1 without differences
    std::size_t different = 0;   // points beyond the tolerance
    bool same = true;
};

struct Comparison {
    std::size_t points_a = 0, points_b = 0, compared = 0;
    std::vector<std::int64_t> only_a, only_b;  // ids
    double tolerance = 0;
    double tolerance_P = 0;                       // m
    std::vector<AttributeDifference> attributes;  // P and v first, then the others by name
    std::vector<AttributeDifference> groups;      // `different` counts members; a missing group is empty
    bool same = true;
};

// Compares by id. P is the same within `tolerance` times the diagonal of the joint bounding box. Other floats are the
// same within `tolerance` times the larger of the two values (norms of vectors), and integers and groups only if equal.
// An integer and a float attribute are compared by value, because .csv does not distinguish them. An attribute of only
// one set is a difference, unless there are no points.
Comparison compare(const PointSet& a, const PointSet& b, double tolerance = 1e-6);
std::string to_text(const Comparison& comparison);
std::string to_json(const Comparison& comparison);  // one object on one line

// A summary of a point set for `rapid info`.
struct AttributeSummary {
    std::string name;
    AttributeType type;
    bool uniform;                                 // all points have bit-identical values
    std::vector<double> min, max;                 // per component; empty if no value is finite
    std::size_t not_finite = 0;                   // points with a NaN or an infinity
    std::size_t strings = 0;                      // number of distinct strings
    std::vector<std::string> first_strings = {};  // the first few in order
};

struct GroupSummary {
    std::string name;
    std::size_t members;
};

struct PointSummary {
    std::size_t points;
    std::size_t bytes;  // in memory
    Box3f bounds;       // of the finite positions
    std::vector<AttributeSummary> attributes;
    std::vector<GroupSummary> groups;
};

PointSummary describe(const PointSet& points);
std::string to_text(const PointSummary& summary);
std::string to_json(const PointSummary& summary);  // one object on one line

}  // namespace rapid
