// A function of one point, given by the host of the scripting language, for native nodes that take one (`where`): they
// do not know which language it is.
#pragma once

#include <span>

#include "runtime/graph/node.h"
#include "runtime/object.h"

namespace rapid {

class PointFunction : public Object {
public:
    static constexpr std::string_view param_type = "function of a point";
    std::string_view kind() const override { return "function"; }

    // The names that it reads, from its code.
    virtual void uses(Uses& uses) const = 0;

    // Whether it is true of each point, 0 or 1, shape [size]; in parallel. Error: what the script raised, with the
    // point.
    virtual void test(const PointSet& points, const Evaluation& now, std::span<std::uint8_t> result) const = 0;
};

}  // namespace rapid
