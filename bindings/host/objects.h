// Objects that only graph code knows: an attribute's name and a node.
#pragma once

#include <string>

#include "runtime/graph/node.h"
#include "runtime/object.h"

namespace rapid {

// `rapid.attr "bounce"`.
class AttributeName : public Object {
public:
    explicit AttributeName(std::string attribute) : name(std::move(attribute)) {}
    std::string_view kind() const override { return "attribute"; }

    const std::string name;
};

// A node, as graph code holds it.
class NodeHandle : public Object {
public:
    explicit NodeHandle(NodePtr held) : node(std::move(held)) {}
    std::string_view kind() const override { return "node"; }

    const NodePtr node;
};

}  // namespace rapid
