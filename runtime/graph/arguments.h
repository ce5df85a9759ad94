// The arguments of a node, and how they get into the fields of its operator.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/node.h"

namespace rapid {

// Puts the arguments into the fields, with functions of the frame called at `frame`, and shapes that move as they go
// through the step that ends there (step_shape.h). A fresh operator gets all of them; later calls only these. Error: an
// argument that is unknown, missing or illegal.
void bind_arguments(const Node& node, Operator& op, const FrameClock& clock, const Frame& frame, bool only_changing);

// Throws Error if nodes of this type take no argument of that name; the message names the nearest.
void require_param(const NodeType& type, const std::string& name);

// A number that is never a function: the argument, or the parameter's default.
double constant_argument(const Node& node, std::string_view param);

// The name of an argument whose value changes from frame to frame: a function, a motion, a moving object, or a table
// that holds one. Empty where there is none.
std::string varying_argument(const Node& node);

// The parameters of a node whose values are functions that are called once a frame.
std::vector<std::string> functions_of_the_frame(const Node& node);

}  // namespace rapid
