// Graphs with other arguments, for `--sweep solve.substeps=1,2,4`, or with other names.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "runtime/graph/plan.h"

namespace rapid {

// values: by NODE.PARAM, where NODE is the name of a node, or its type if only one node has it. Nodes are immutable,
// so the result has copies that are connected to each other. Throws Error if the graph has no such node or the node no
// such parameter (with the nearest name), if several nodes are of the type, or if there is no dot. The plan checks the
// values.
Graph with_arguments(const Graph& graph, const std::map<std::string, Value>& values);

// Renames nodes for which `may_be_renamed` is true if an earlier node that an output reaches has the same name. The
// new name has the next free number: k, k2, k3.
Graph with_unique_names(const Graph& graph, const std::function<bool(const Node&)>& may_be_renamed);

}  // namespace rapid
