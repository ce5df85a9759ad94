// The same graph with other arguments: what `--sweep solve.substeps=1,2,4` varies.
#pragma once

#include <map>
#include <string>

#include "runtime/graph/plan.h"

namespace rapid {

// `values` by NODE.PARAM, where NODE is a node's name, or its type where only one node has it. Nodes are values: those
// named, and all that come after them, are new ones. Whether a node has the parameter is the plan's to say. Error: no
// such node (with the nearest name), several of the type, no dot.
Graph with_arguments(const Graph& graph, const std::map<std::string, Value>& values);

}  // namespace rapid
