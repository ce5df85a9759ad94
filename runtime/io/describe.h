// A summary of a point set for `rapid info`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

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
