// Rapid's own functions of Lua's `math`, by name, for lua/elementary.lua and for lanes.
#pragma once

#include <string_view>
#include <utility>

#include "runtime/lanes/lane_program.h"
#include "runtime/math/hyperbolic.h"
#include "runtime/math/power.h"

namespace rapid {

inline constexpr std::pair<std::string_view, LaneProgram::Function1> math_functions1[] = {
    {"acos", arc_cosine},
    {"asin", arc_sine},
    {"atan", arc_tangent},
    {"cos", cosine},
    {"cosh", hyperbolic_cosine},
    {"exp", exponential},
    {"log", logarithm},
    {"log10", logarithm10},
    {"sin", sine},
    {"sinh", hyperbolic_sine},
    {"tan", tangent},
    {"tanh", hyperbolic_tangent},
};
inline constexpr std::pair<std::string_view, LaneProgram::Function2> math_functions2[] = {
    {"atan2", arc_tangent},
    {"ldexp", times_power_of_two},
    {"log", logarithm},
    {"pow", power},
};

}  // namespace rapid
