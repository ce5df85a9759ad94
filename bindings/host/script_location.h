// Positions in graph code: the line of a scene or module that calls, or that defines a function.
//
// Chunk names of graph code begin with @ and are shown unchanged; Rapid's own begin with =[rapid.
#pragma once

#include "runtime/base/error.h"

struct lua_Debug;
struct lua_State;

namespace rapid {

class State;

// info: with its source field filled in.
bool is_graph_code(const lua_Debug& info);

// Returns the nearest line of graph code on the stack.
Location where(const State& state);

// Returns the position of the function at `index`. The file is empty if it is not in graph code.
Location location_of_function(lua_State* L, int index);

// native.run(chunk, file, line, ...): calls the body of a file, or the scene of a study with its knobs. line is that of
// the call that ends it, or nil.
int run_body(lua_State* L);

// Returns true for the frame of run_body(): a body that has left by a tail call would lie directly above it.
bool is_run_body(lua_State* L, lua_Debug& info);

}  // namespace rapid
