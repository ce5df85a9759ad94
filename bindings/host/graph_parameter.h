// rapid.param: a value of the graph that --set can replace.
#pragma once

#include <string>

#include "runtime/graph/value.h"

namespace rapid {

class State;

// The value of an argument that a command line gives as text: true or false, a number, a vec3 {x,y,z}, else the text.
Value read_argument(const std::string& text);

// Native function of lua/rapid.lua: (name, default, doc): the value.
int declare_parameter(State& state);

}  // namespace rapid
