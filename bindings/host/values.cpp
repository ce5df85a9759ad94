#include "bindings/host/values.h"

#include <fmt/format.h>

#include <lua.hpp>

#include "bindings/host/handle_memory.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/objects.h"
#include "bindings/host/ramp.h"
#include "bindings/host/script_error.h"
#include "bindings/host/script_function.h"
#include "bindings/host/state.h"

namespace rapid {
namespace {

constexpr char object_metatable[] = "rapid.object";
constexpr int cdata_type = 10;  // LUA_TCDATA, which lua.h does not define

// Reads the entries of the table at `index` that are not in its list.
void read_entries(State& state, int index, Table& table)
{
    lua_State* L = state.lua();
    const auto length = static_cast<std::int64_t>(table.list.size());
    lua_pushnil(L);
    while (lua_next(L, index)) {
        if (lua_type(L, -2) == LUA_TSTRING) {
            table.named.emplace(lua_tostring(L, -2), to_value(state, -1));
        } else if (lua_type(L, -2) == LUA_TNUMBER) {
            const double key = lua_tonumber(L, -2);
            const auto whole = static_cast<std::int64_t>(key);
            if (static_cast<double>(whole) != key)
                throw Error(fmt::format("a table has the key {}; numeric keys must be whole numbers", key));
            if (whole < 1 || whole > length) table.numbered.emplace(whole, to_value(state, -1));
        } else {
            throw Error(
                fmt::format("a table has a {} as a key; keys must be names or whole numbers", luaL_typename(L, -2)));
        }
        lua_pop(L, 1);
    }
}

Value to_table(State& state, int index)
{
    lua_State* L = state.lua();
    auto table = std::make_shared<Table>();
    // The length of a table of keys, {[2] = a, [14] = b}, may be any index that is followed by nil.
    lua_rawgeti(L, index, 1);
    const std::size_t length = lua_isnil(L, -1) ? 0 : lua_objlen(L, index);
    lua_pop(L, 1);
    table->list.reserve(length);
    for (std::size_t i = 1; i <= length; ++i) {
        lua_rawgeti(L, index, static_cast<int>(i));
        table->list.push_back(to_value(state, -1));
        lua_pop(L, 1);
    }
    read_entries(state, index, *table);
    return Value(std::shared_ptr<const Table>(std::move(table)));
}

// Returns nil for any other cdata.
Value to_vec3(State& state, int index)
{
    lua_State* L = state.lua();
    state.push_entry("unpack_vec3");
    lua_pushvalue(L, index);
    state.call(1, 3);
    const bool is_vec3 = !lua_isnil(L, -3);
    const Vec3d v(lua_tonumber(L, -3), lua_tonumber(L, -2), lua_tonumber(L, -1));
    lua_pop(L, 3);
    return is_vec3 ? Value(v) : Value();
}

// Returns nil for a userdata that is not an object of the runtime.
Value to_object_value(State& state, int index)
{
    const ObjectPtr object = to_object(state, index);
    if (const auto* name = dynamic_cast<const AttributeName*>(object.get())) return Value(AttributeRef{name->name});
    return object ? Value(object) : Value();
}

void push_table(State& state, const Table& table)
{
    lua_State* L = state.lua();
    lua_createtable(L, static_cast<int>(table.list.size()), static_cast<int>(table.named.size()));
    int place = 0;
    for (const Value& element : table.list) {
        push(state, element);
        lua_rawseti(L, -2, ++place);
    }
    for (const auto& [key, element] : table.numbered) {
        push(state, element);
        lua_rawseti(L, -2, static_cast<int>(key));
    }
    for (const auto& [key, element] : table.named) {
        push_text(L, key);
        push(state, element);
        lua_rawset(L, -3);
    }
}

// Pushes the function that lua/ramp.lua makes from the keys.
void push_ramp(State& state, const Ramp& ramp)
{
    lua_State* L = state.lua();
    state.push_entry("make_ramp");
    lua_createtable(L, static_cast<int>(ramp.keys.size()), 0);
    for (std::size_t i = 0; i < ramp.keys.size(); ++i) {
        const auto& [position, of_key] = ramp.keys[i];
        push_table(state, Table{{Value(position), of_key}, {}, {}});
        lua_rawseti(L, -2, static_cast<int>(i) + 1);
    }
    state.call(1, 1);
}

// Returns the error for a Lua value without a runtime form. A frame is recognized by its text.
std::string no_value(lua_State* L, int index)
{
    if (lua_type(L, index) == cdata_type && luaL_callmeta(L, index, "__tostring")) {
        const std::string text = text_at(L, -1);
        lua_pop(L, 1);
        if (text.starts_with("frame "))
            return "the frame can't be used as a value here; it has frame.time, frame.number and frame.dt";
    }
    return fmt::format("a {} can't be used as a value here", luaL_typename(L, index));
}

}  // namespace

Value to_value(State& state, int index)
{
    lua_State* L = state.lua();
    if (index < 0) index = lua_gettop(L) + index + 1;
    if (!lua_checkstack(L, 8)) throw Error("a table is nested too deeply");
    Value value;
    switch (lua_type(L, index)) {
        case LUA_TNIL:
            return {};
        case LUA_TBOOLEAN:
            return Value(lua_toboolean(L, index) != 0);
        case LUA_TNUMBER:
            return Value(static_cast<double>(lua_tonumber(L, index)));
        case LUA_TSTRING:
            return Value(text_at(L, index));
        case LUA_TFUNCTION:
            return Value(script_function(state, index));
        case LUA_TTABLE:
            return to_table(state, index);
        case LUA_TUSERDATA:
            value = to_object_value(state, index);
            break;
        case cdata_type:
            value = to_vec3(state, index);
            break;
        default:
            break;
    }
    if (value.is_nil()) throw Error(no_value(L, index));
    return value;
}

ObjectPtr to_object(State& state, int index)
{
    lua_State* L = state.lua();
    if (lua_type(L, index) != LUA_TUSERDATA || !lua_getmetatable(L, index)) return nullptr;
    luaL_getmetatable(L, object_metatable);
    const bool ours = lua_rawequal(L, -1, -2) != 0;
    lua_pop(L, 2);
    if (!ours) return nullptr;
    const ObjectPtr& object = *static_cast<ObjectPtr*>(lua_touserdata(L, index));
    if (!object) throw Error("the object was already collected as garbage");
    return object;
}

void push(State& state, const Value& value)
{
    lua_State* L = state.lua();
    if (const auto* boolean = value.get<bool>()) {
        lua_pushboolean(L, *boolean);
    } else if (const auto* number = value.get<double>()) {
        lua_pushnumber(L, *number);
    } else if (const auto* text = value.get<std::string>()) {
        push_text(L, *text);
    } else if (const auto* v = value.get<Vec3d>()) {
        state.push_entry("make_vec3");
        for (int axis = 0; axis < 3; ++axis) lua_pushnumber(L, (*v)[axis]);
        state.call(3, 1);
    } else if (const auto ramp = value.object<Ramp>()) {
        push_ramp(state, *ramp);
    } else if (const auto* object = value.get<ObjectPtr>()) {
        push_object(state, *object);
    } else if (const Table* table = value.table()) {
        push_table(state, *table);
    } else if (const auto* reference = value.get<AttributeRef>()) {
        push_object(state, std::make_shared<AttributeName>(reference->name));
    } else {
        lua_pushnil(L);
    }
}

void push(State& state, std::map<std::string, Value> entries) { push_table(state, Table{{}, {}, std::move(entries)}); }

void push_object(State& state, const ObjectPtr& object)
{
    lua_State* L = state.lua();
    if (!object) return lua_pushnil(L);  // of a sequence without an object at this frame
    hold(L, *object);
    new (lua_newuserdata(L, sizeof(ObjectPtr))) ObjectPtr(object);
    luaL_getmetatable(L, object_metatable);
    lua_setmetatable(L, -2);
}

void register_objects(lua_State* L)
{
    count_handles(L);
    luaL_newmetatable(L, object_metatable);
    lua_pushcfunction(L, [](lua_State* of_object) -> int {
        ObjectPtr& object = *static_cast<ObjectPtr*>(lua_touserdata(of_object, 1));
        release(of_object, *object);
        object.reset();  // a resurrected handle holds nothing
        return 0;
    });
    lua_setfield(L, -2, "__gc");
    lua_pushboolean(L, 0);
    lua_setfield(L, -2, "__metatable");
    lua_pop(L, 1);
}

int set_object_methods(State& state)
{
    lua_State* L = state.lua();
    luaL_getmetatable(L, object_metatable);
    lua_pushvalue(L, 1);
    lua_setfield(L, -2, "__index");
    lua_pushvalue(L, 2);
    lua_setfield(L, -2, "__mul");
    lua_pushvalue(L, 3);
    lua_setfield(L, -2, "__call");
    lua_pushcfunction(L, [](lua_State* of_object) {
        return guarded(of_object, [](State& s) {
            push_text(s.lua(), describe(Value(to_object(s, 1))));
            return 1;
        });
    });
    lua_setfield(L, -2, "__tostring");
    return 0;
}

}  // namespace rapid
