// Translates errors between Lua and C++: an error in a script becomes an Error at its line of graph code, and an Error
// that a native function throws becomes a Lua error.
#pragma once

#include <string>

#include "runtime/base/error.h"

struct lua_State;
struct lua_Debug;

namespace rapid {

class State;

// Message handler for lua_pcall: replaces the error with a description for take_error().
int describe_error(lua_State* L);

// Pops the error that a call has left at the top of the stack, and returns it. status: the call's, not 0.
Error take_error(lua_State* L, int status);

// Pops the table of lua/engine_errors.lua: Rapid's replacements for LuaJIT's own messages.
void set_engine_errors(lua_State* L);

// Runs f for a function that Lua calls, and turns an Error into a Lua error at the calling graph code.
int guarded(lua_State* L, int (*f)(State& state));

template <int (*f)(State&)>
int native(lua_State* L)
{
    return guarded(L, f);
}

// Positions in graph code: the line of a scene or module that calls, or that defines a function.
//
// Chunk names of graph code begin with @ and are shown unchanged; Rapid's own begin with =[rapid.

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
