// Nodes written in Lua in the current folder and on RAPID_PATH.
#pragma once

#include <string>
#include <vector>

#include "runtime/graph/registry.h"

namespace rapid {

struct NodeTypes {
    Registry registry;                // these, and those of Session::all_node_types()
    std::vector<std::string> faults;  // messages for files whose node definition is wrong
};

NodeTypes with_own_nodes();

}  // namespace rapid
