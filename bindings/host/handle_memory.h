// What the handles of a state hold: level sets, meshes and points, whose bytes Lua's collector does not see. It runs
// when they have doubled, so that a script which makes another one in each frame keeps a few, not all. Many that are
// small, nodes of the graph too, fill the memory as one does that is large: beyond the budget the next one is an error.
#pragma once

#include <cstddef>

#include "runtime/base/object.h"

struct lua_State;

namespace rapid {

// Of a new state: keeps the counts in its registry.
void count_handles(lua_State* L);

// A handle holds an object, or has let it go. The first may run the collector. Error: the memory is full.
void hold(lua_State* L, const Object& object);
void release(lua_State* L, const Object& object);

}  // namespace rapid
