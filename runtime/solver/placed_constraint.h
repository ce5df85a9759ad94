// Constraints whose positions are functions of time within a step.
#pragma once

#include <array>
#include <memory>
#include <string_view>

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// The type of a parameter that gives positions, which are interpolated if it is a function of the frame.
constexpr std::string_view place_type = "vec3, attribute or moving shape";

// An interface of a Constraint whose node has such a parameter.
class Placed {
public:
    virtual ~Placed() = default;

    // Parts of the step at which positions are given.
    static constexpr std::array<double, 4> parts = {0, 1.0 / 3, 2.0 / 3, 1};
    using AtParts = std::array<std::shared_ptr<const Constraint>, parts.size()>;

    // Returns the constraint in its state at the end of the step, with positions on the cubic through those at
    // `parts`. Returns null if these are not numbers.
    virtual std::shared_ptr<const Constraint> through(const AtParts& at) const = 0;
};

}  // namespace rapid
