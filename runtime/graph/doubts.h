// Warnings of graphs that are legal and probably not what was meant.
#pragma once

#include <string>
#include <vector>

#include "runtime/graph/plan.h"

namespace rapid {

// Nodes whose result is dropped, that wait for what never comes, or make what nothing uses, each with what to do. plan:
// that of the graph, whose attributes are found.
std::vector<std::string> doubts_about(const Graph& graph, const Plan& plan);

}  // namespace rapid
