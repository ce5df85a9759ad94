// Translates errors between Lua and C++: an error in a script becomes an Error at its line of graph code, and an Error
// that a native function throws becomes a Lua error.
#pragma once

#include <string>

#include "runtime/base/error.h"

struct lua_State;

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

}  // namespace rapid
