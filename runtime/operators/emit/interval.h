// A parameter that is one number for all points, or uniform between two: 2 or {1, 3}.
#pragma once

#include <string>
#include <string_view>

#include "runtime/graph/param.h"

namespace rapid {

struct Interval {
    static constexpr std::string_view param_type = "number or {min, max}";
    double min = 0, max = 0;

    bool is_single() const { return min == max; }
    // u: uniform in [0, 1).
    double at(double u) const { return is_single() ? min : min + (max - min) * u; }
};

void read_value(const Param& param, const Value& value, Interval& field);

inline bool is_zero(const Interval& interval) { return interval.min == 0 && interval.max == 0; }
// 2, or {1, 3}.
std::string describe(const Interval& interval);

}  // namespace rapid
