// What newborn points have of what they are born from: the parameter `inherit`, a part of the velocity or names of
// attributes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/param.h"

namespace rapid {

struct Inheritance {
    static constexpr std::string_view param_type = "number or names";
    double share = 1;
    std::vector<std::string> names;
};

inline void read_value(const Param& param, const Value& value, Inheritance& field)
{
    field = {};
    if (value.get<double>())
        read_value(param, value, field.share);
    else
        read_value(param, value, field.names);
}

}  // namespace rapid
