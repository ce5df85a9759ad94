// Errors between Lua and C++: what a script raises becomes an Error at its line of graph code, and an Error that a
// native function throws becomes a Lua error.
#pragma once

#include <string>

#include "runtime/base/error.h"

struct lua_State;

namespace rapid {

class State;

// A message handler of lua_pcall: replaces the error by a description, for take_error().
int describe_error(lua_State* L);

// The error at the top of the stack that a call has left with this status, not 0; takes it off.
Error take_error(lua_State* L, int status);

// Takes the table of lua/engine_errors.lua off the stack: what Rapid says in place of LuaJIT's own messages.
void set_engine_errors(lua_State* L);

// Runs f for a function that Lua calls, and turns an Error into a Lua error at the calling graph code.
int guarded(lua_State* L, int (*f)(State& state));

template <int (*f)(State&)>
int native(lua_State* L)
{
    return guarded(L, f);
}

}  // namespace rapid
