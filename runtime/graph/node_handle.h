// A node as a value: in graph code, and as an argument of a node that reads its points (spawn's `from`).
#pragma once

#include "runtime/base/object.h"
#include "runtime/graph/node_type.h"

namespace rapid {

class NodeHandle : public Object {
public:
    static constexpr std::string_view param_type = "node";
    explicit NodeHandle(NodePtr held) : node(std::move(held)) {}
    std::string_view kind() const override { return "node"; }

    const NodePtr node;
};

}  // namespace rapid
