// Places in graph code: which line of a scene or of its modules calls, or defines a function.
//
// Chunk names of graph code begin with @ and are shown as they are; Rapid's own begin with =[rapid.
#pragma once

#include "runtime/base/error.h"

struct lua_Debug;
struct lua_State;

namespace rapid {

class State;

// info: with its source filled in.
bool is_graph_code(const lua_Debug& info);

// The nearest line of graph code on the stack.
Location where(const State& state);

// The definition of the function at `index`. No file where it is not in graph code.
Location place_of_function(lua_State* L, int index);

// native.run(chunk, file, line, ...): calls the body of a file, or the scene of a study with its knobs, which ends in a
// call at that line, or in none (nil).
int run_body(lua_State* L);

// Whether the frame is that of run_body(): a body that has left by a tail call would lie directly above it.
bool is_run_body(lua_State* L, lua_Debug& info);

}  // namespace rapid
