// A ramp: keys {position, value} of a script node's parameter. The kernel gets it as a function of the position.
#pragma once

#include <utility>
#include <vector>

#include "runtime/graph/param.h"

namespace rapid {

class Ramp : public Object {
public:
    static constexpr std::string_view param_type = "ramp";
    std::string_view kind() const override { return "ramp"; }

    // At least one key, with rising positions. The values are all numbers or all vec3.
    std::vector<std::pair<double, Value>> keys;
};

// Returns the ramp. Throws Error if the value is not a list of keys.
std::shared_ptr<const Ramp> read_ramp(const Param& param, const Value& value);

}  // namespace rapid
