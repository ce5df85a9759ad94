// Results of scenes in script-level tests: point sets as userdata.
#pragma once

#include "runtime/points/point_set.h"

struct lua_State;

namespace rapid {

// source: for messages, "frame 48", "frame 48, output sparks".
void push_points(lua_State* L, PointSet points, std::string source);

// Adds the functions on points to the table at the top of the stack, and `points_metatable`, whose __index Lua sets.
void register_points(lua_State* L);

}  // namespace rapid
