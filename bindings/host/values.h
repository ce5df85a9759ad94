// Converts values between Lua and the runtime: numbers, strings, vec3, tables, objects and functions of the frame.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/node_type.h"
#include "runtime/graph/param.h"
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

// A ramp: keys {position, value} of a script node's parameter. The kernel gets it as a function of the position.
class Ramp : public Object {
public:
    static constexpr std::string_view param_type = "ramp";
    std::string_view kind() const override { return "ramp"; }

    // At least one key, with rising positions. The values are all numbers or all vec3.
    std::vector<std::pair<double, Value>> keys;
};

// Returns the ramp. Throws Error if the value is not a list of keys.
std::shared_ptr<const Ramp> read_ramp(const Param& param, const Value& value);

// Returns the function at `index` of the main state's stack. The registry holds it as long as any node does.
std::shared_ptr<const FrameFunction> script_function(State& state, int index);

// Reads the function's bytecode. Throws Error if it stores something for its next call, which no snapshot can
// hold.
void refuse_memory(const FrameFunction& function);

// `rapid.attr "bounce"`.
class AttributeName : public Object {
public:
    explicit AttributeName(std::string attribute) : name(std::move(attribute)) {}
    std::string_view kind() const override { return "attribute"; }

    const std::string name;
};

}  // namespace rapid
