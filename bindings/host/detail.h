// Runs :detail, a Lua function over a whole set of points.
#pragma once

#include <map>
#include <string>

#include "runtime/graph/node.h"

namespace rapid {

class Kernel;
struct KernelArguments;

// Calls function(points, frame, params) once, in the main state. Afterwards the points that it added are appended, with
// new ids, and those that it killed are removed. Rethrows the function's error with the frame.
void run_detail(const Kernel& function, Flow& flow, const Evaluation& now, const KernelArguments& arguments);

// Returns the detail values as scripts see them.
std::map<std::string, Value> values_of(const std::map<std::string, DetailValue, std::less<>>& details);

}  // namespace rapid
