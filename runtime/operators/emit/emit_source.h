// The parameter `source` of emit: an object that bears, or a node whose points do.
#pragma once

#include <memory>
#include <string_view>

#include "runtime/graph/node_handle.h"
#include "runtime/graph/param.h"

namespace rapid {

struct EmitSource {
    static constexpr std::string_view param_type = "mesh, level set, shape, fog, curve, points or node";
    ObjectPtr object;
    bool is_node = false;
};

inline void read_value(const Param& param, const Value& value, EmitSource& field)
{
    read_value(param, value, field.object);
    if (!field.object) wrong_type(param, value);
    field.is_node = std::dynamic_pointer_cast<const NodeHandle>(field.object) != nullptr;
}

}  // namespace rapid
