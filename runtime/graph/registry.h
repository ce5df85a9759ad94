// The node types of a session: native types, and those added by Lua files.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/node.h"
#include "runtime/graph/node_type.h"

namespace rapid {

// Creates nodes for chains of any length.

// Returns a node that releases its inputs, and the nodes in its arguments, iteratively. Nested destructor calls would
// overflow the stack.
std::shared_ptr<Node> make_node(const Node& node = {});

class Registry {
public:
    // Contains all native types.
    Registry();

    // Throws Error if the name is taken.
    const NodeType& add(NodeType type);

    // Returns null if there is no such type.
    const NodeType* find(std::string_view name) const;
    // Throws Error if there is no such type, with the nearest name.
    const NodeType& at(std::string_view name) const;

    // Returns the types in order of name, so that the link order has no visible effect.
    std::vector<const NodeType*> types() const;

private:
    std::deque<NodeType> types_;  // a deque, because nodes point to their type
};

}  // namespace rapid
