// A graph with some arguments replaced, as `--sweep solve.substeps=1,2,4` does.
#pragma once

#include <map>
#include <string>

#include "runtime/graph/plan.h"

namespace rapid {

// values: by NODE.PARAM, where NODE is the name of a node, or its type if no other node has it. Nodes are immutable:
// the result has copies. The plan checks whether the node has the parameter. Error: no such node (with the nearest
// name), several nodes of the type, no dot.
Graph with_arguments(const Graph& graph, const std::map<std::string, Value>& values);

}  // namespace rapid
