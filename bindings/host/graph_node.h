// The nodes that a graph's body makes: node:type { ... }.
#pragma once

namespace rapid {

class State;

// Native functions of lua/rapid.lua.
int make_node(State& state);     // (type, arguments, inputs...): the node
int has_type(State& state);      // (type): whether it is defined in this state
int unknown_type(State& state);  // (type): an error, always

}  // namespace rapid
