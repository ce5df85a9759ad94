// The page of a node type, for people and for programs.
#pragma once

#include <string>
#include <vector>

#include "runtime/graph/node.h"
#include "runtime/graph/param.h"
#include "runtime/graph/registry.h"

namespace rapid {

std::string page_of(const NodeType& type);
std::string json_of(const NodeType& type);  // an object, in one line

// "[number, m/s, at least 0, default 0.5, takes rapid.attr]", "[integer, default 1, constant]"
std::string facts_of(const Param& param);

// Nodes written in Lua in the current folder and on RAPID_PATH.
struct NodeTypes {
    Registry registry;                // these, and those of Session::all_node_types()
    std::vector<std::string> faults;  // messages for files whose node definition is wrong
};

NodeTypes with_own_nodes();

}  // namespace rapid
