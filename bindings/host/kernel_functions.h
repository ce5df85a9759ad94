// Functions that compiled kernels call directly by address (lua/chunk.h has their types).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "runtime/graph/step_shape.h"
#include "runtime/lanes/lane_program.h"
#include "runtime/math/hyperbolic.h"
#include "runtime/math/power.h"

struct lua_State;

namespace rapid {

// Sets the addresses in the table at the top of the stack.
void set_kernel_functions(lua_State* L);

// The time of the point that a kernel processes on this thread, for queries of moving shapes.
class KernelMoment {
public:
    // Applies on this thread until destruction. times: the chunk's points, s since the start; null means the end of the
    // step. at: the point being processed.
    KernelMoment(const double* times, const std::int32_t* at);
    ~KernelMoment();
    KernelMoment(const KernelMoment&) = delete;
    KernelMoment& operator=(const KernelMoment&) = delete;

    // Returns the current time, s since the start, or nothing for the end of the step.
    static std::optional<double> time();
    // Returns the current time, s since the beginning of the shape's step.
    static double since_begin(const StepShape& shape);

private:
    const double* times_;
    const std::int32_t* at_;
    const KernelMoment* outer_;
};

// Rapid's own functions of Lua's `math`, by name, for lua/elementary.lua and for lanes.
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
