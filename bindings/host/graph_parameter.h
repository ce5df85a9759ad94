// rapid.param: a value of the graph that --set can replace.
#pragma once

namespace rapid {

class State;

// Native function of lua/rapid.lua: (name, default, doc): the value.
int declare_parameter(State& state);

}  // namespace rapid
