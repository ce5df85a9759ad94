// Nodes that may be in a chain of any length.
#pragma once

#include <memory>

#include "runtime/graph/node_type.h"

namespace rapid {

// A node that lets go of its inputs, and of the nodes in its arguments, one after the other: the destructor of each
// would call that of the one before it, and fill the stack.
std::shared_ptr<Node> make_node(const Node& node = {});

}  // namespace rapid
