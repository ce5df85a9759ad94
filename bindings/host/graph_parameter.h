// rapid.param: a value of the graph that --set can replace.
#pragma once

#include <string>

#include "runtime/graph/value.h"

namespace rapid {

class State;

// Returns the value of an argument given as text on a command line: a boolean, a number, a vec3 {x,y,z}, else the text.
Value read_argument(const std::string& text);

// Native function of lua/rapid.lua: takes (name, default, doc) and returns the value.
int declare_parameter(State& state);

}  // namespace rapid
