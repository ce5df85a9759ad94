// Creates the nodes of a graph's body: node:type { ... }.
#pragma once

namespace rapid {

class State;

// Native functions of lua/rapid.lua.
int make_node(State& state);     // (type, arguments, inputs...): the node
int has_type(State& state);      // (type): true if it is defined in this state
int unknown_type(State& state);  // (type): always an error

}  // namespace rapid
