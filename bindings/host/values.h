// Converts values between Lua and the runtime: numbers, strings, vec3, tables, objects and functions of the frame.
#pragma once

#include "runtime/graph/value.h"

struct lua_State;

namespace rapid {

class State;

// Returns the value at `index`. A function becomes a FrameFunction, in the main state only. Throws Error if the
// value has no form in the runtime.
Value to_value(State& state, int index);
// Returns null if the value is not an object of the runtime.
ObjectPtr to_object(State& state, int index);

void push(State& state, const Value& value);
// Pushes a table with these entries by name.
void push(State& state, std::map<std::string, Value> entries);
void push_object(State& state, const ObjectPtr& object);

// Makes the metatable of objects in a new state. set_object_methods() sets its fields.
void register_objects(lua_State* L);

// native.set_index(index, product, call): sets the metamethods of objects: reading a field, multiplying two, calling
// one.
int set_object_methods(State& state);

}  // namespace rapid
