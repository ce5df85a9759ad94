// Values between Lua and the runtime: numbers, texts, vec3, tables, objects and functions of the frame.
#pragma once

#include "runtime/graph/value.h"

struct lua_State;

namespace rapid {

class State;

// The value at `index`. A function becomes a FrameFunction, in the main state only. Error: a value that has no form in
// the runtime.
Value to_value(State& state, int index);
// Null where the value is no object of the runtime's.
ObjectPtr to_object(State& state, int index);

void push(State& state, const Value& value);
// A table of these entries by name.
void push(State& state, std::map<std::string, Value> entries);
void push_object(State& state, const ObjectPtr& object);

// Makes the metatable of objects in a new state. Its fields are set by set_object_methods().
void register_objects(lua_State* L);

// native.set_index(index, product, call): sets what reading a field of an object, multiplying two, and calling one do.
int set_object_methods(State& state);

}  // namespace rapid
