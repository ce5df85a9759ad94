// The arguments of a node, and their assignment to the fields of its operator.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/node.h"

namespace rapid {

// Assigns the arguments to the fields. Functions of the frame are called at `frame`; moving shapes cover the step that
// ends there (step_shape.h). A fresh operator gets all arguments, later calls only those that change. Throws Error if
// an argument is unknown, missing or illegal.
void bind_arguments(const Node& node, Operator& op, const FrameClock& clock, const Frame& frame, bool only_changing);

// Throws Error if nodes of this type take no argument of that name; the message names the nearest.
void require_param(const NodeType& type, const std::string& name);

// Returns a number that is never a function: the argument, or the parameter's default.
double constant_argument(const Node& node, std::string_view param);

// Returns the name of an argument whose value changes from frame to frame: a function, a motion, a moving object, or a
// table that contains one. Empty if there is none.
std::string varying_argument(const Node& node);

// Returns the parameters of a node whose values are functions called once per frame.
std::vector<std::string> functions_of_the_frame(const Node& node);

}  // namespace rapid
