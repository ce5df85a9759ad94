// A graph with some arguments replaced, as `--sweep solve.substeps=1,2,4` does.
#pragma once

#include <map>
#include <string>

#include "runtime/graph/plan.h"

namespace rapid {

// values: by NODE.PARAM, where NODE is the name of a node, or its type if no other node has it. Nodes are immutable, so
// the result has copies, which are the inputs and sources of one another. Throws Error if the graph has no such node or
// the node no such parameter (with the nearest name), if several nodes are of the type, or if there is no dot. The plan
// checks the values.
Graph with_arguments(const Graph& graph, const std::map<std::string, Value>& values);

}  // namespace rapid
