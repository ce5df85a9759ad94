// Accounts for the memory of objects that handles hold: level sets, meshes and points, whose bytes Lua's collector does
// not see. The collector runs when they have doubled, so that a script that makes a new one in each frame retains a
// few, not all. Small objects, graph nodes included, count too: beyond the budget the next one is an error.
#pragma once

#include <cstddef>

#include "runtime/base/object.h"

struct lua_State;

namespace rapid {

// Stores the counts of a new state in its registry.
void count_handles(lua_State* L);

// Counts an object that a handle holds or releases. hold() may run the collector. Throws Error if the memory is
// full.
void hold(lua_State* L, const Object& object);
void release(lua_State* L, const Object& object);

}  // namespace rapid
