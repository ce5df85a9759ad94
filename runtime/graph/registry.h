// The node types of a session: the native ones, and those that Lua files add.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/node.h"
#include "runtime/graph/node_type.h"

namespace rapid {

// Nodes that may be in a chain of any length.

// A node that lets go of its inputs, and of the nodes in its arguments, one after the other: the destructor of each
// would call that of the one before it, and fill the stack.
std::shared_ptr<Node> make_node(const Node& node = {});

class Registry {
public:
    // All native types.
    Registry();

    // Error: a name that is taken.
    const NodeType& add(NodeType type);

    // Null where there is none.
    const NodeType* find(std::string_view name) const;
    // Error: no such type, with the nearest name.
    const NodeType& at(std::string_view name) const;

    // In order of name, so that link order changes nothing a user can see.
    std::vector<const NodeType*> types() const;

private:
    std::deque<NodeType> types_;  // a node keeps a pointer to its type
};

}  // namespace rapid
