// Constraints whose places are functions of time within a step.
#pragma once

#include <array>
#include <memory>
#include <string_view>

#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// The type of a parameter that gives places: where it is a function of the frame, they are interpolated.
constexpr std::string_view place_type = "vec3, attribute or moving shape";

// What a Constraint is, too, whose node has such a parameter.
class Placed {
public:
    virtual ~Placed() = default;

    // Parts of the step at which places are given.
    static constexpr std::array<double, 4> parts = {0, 1.0 / 3, 2.0 / 3, 1};
    using AtParts = std::array<std::shared_ptr<const Constraint>, parts.size()>;

    // The constraint as it is at the end of the step, with places on the cubic through those that it has at `parts`.
    // Null where these are no numbers.
    virtual std::shared_ptr<const Constraint> through(const AtParts& at) const = 0;
};

}  // namespace rapid
