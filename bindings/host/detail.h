// Functions over a whole set of points, written in Lua: the runs of :detail.
#pragma once

#include <map>
#include <string>

#include "runtime/graph/node.h"

namespace rapid {

class Kernel;
struct KernelArguments;

// Runs the function once, in the main state: function(points, frame, params). When it ends, the points that it added
// are appended, with ids of their own, and those that it killed are removed. Error: the one that it raised, with the
// frame.
void run_detail(const Kernel& function, Flow& flow, const Evaluation& now, const KernelArguments& arguments);

// As scripts see them.
std::map<std::string, Value> values_of(const std::map<std::string, DetailValue, std::less<>>& details);

}  // namespace rapid
