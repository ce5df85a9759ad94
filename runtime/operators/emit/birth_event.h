// The moment at which points of a node bear others: the parameter `on`.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "runtime/graph/param.h"
#include "runtime/graph/point_function.h"

namespace rapid {

// "age > 0.5", "P.y < 0": true from a moment on.
struct AttributeComparison {
    enum Relation { Below, AtMost, Above, AtLeast };
    std::string attribute;
    int axis = -1;  // of a vec3; -1 of a number
    Relation relation = Above;
    double limit = 0;

    bool holds(double value) const
    {
        switch (relation) {
            case Below:
                return value < limit;
            case AtMost:
                return value <= limit;
            case Above:
                return value > limit;
            case AtLeast:
                break;
        }
        return value >= limit;
    }
};

struct BirthEvent {
    // Functions are made kernels by the host of the scripting language, as the end of this says.
    static constexpr std::string_view param_type = "event or function of a point";

    enum Kind { Hit, Death, Birth, Compares, Tests };
    Kind kind = Hit;
    AttributeComparison comparison;
    std::shared_ptr<const PointFunction> test;

    // What it reads of its points.
    void uses(Uses& uses) const;
};

void read_value(const Param& param, const Value& value, BirthEvent& field);

}  // namespace rapid
