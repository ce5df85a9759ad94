// Node types that artists write in Lua (rapid.node).
#pragma once

#include <string>

namespace rapid {

class State;
struct NodeType;

// Native functions of lua/rapid.lua.
int define_node_type(State& state);    // rapid.node{...}: adds the type (main state) and stores its kernel
int complete_arguments(State& state);  // (type, arguments): returns the checked arguments with defaults filled in

// Returns true if a parameter of the type names a group that its kernel changes.
bool names_groups(const NodeType& type);

// Pushes the kernel of a type that rapid.node has defined in this state, or nil if it has none.
void push_kernel_of_type(State& state, const std::string& type);

}  // namespace rapid
