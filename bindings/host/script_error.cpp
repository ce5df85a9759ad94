#include "bindings/host/script_error.h"

#include <fmt/format.h>

#include <cstdlib>
#include <lua.hpp>
#include <new>
#include <optional>
#include <utility>

#include "bindings/host/lua_text.h"
#include "bindings/host/state.h"

namespace rapid {
namespace {

constexpr int levels_searched = 50;  // for an error's own line, which `error(text, level)` may put further down
constexpr char engine_errors[] = "rapid.engine_errors";  // in the registry

// Fields of the table that describe_error() makes.
enum Description { message_field = 1, location_field, trace_field, is_memory_field };

struct EngineError {
    std::string message;
    bool full_stack;  // Lua leaves only a few slots to the message handler
    bool is_memory;   // there was none left
};

// Returns the replacement for one of LuaJIT's own errors: limits and assignments to constants.
std::optional<EngineError> engine_error(lua_State* L, const std::string& message)
{
    const int top = lua_gettop(L);
    std::optional<EngineError> found;
    lua_getfield(L, LUA_REGISTRYINDEX, engine_errors);
    if (lua_istable(L, -1)) {
        lua_pushlstring(L, message.data(), message.size());
        lua_rawget(L, -2);
        if (lua_istable(L, -1)) {
            const auto is_set = [&](const char* name) {
                lua_getfield(L, -1, name);
                const bool set = lua_toboolean(L, -1) != 0;
                lua_pop(L, 1);
                return set;
            };
            const bool full_stack = is_set("full_stack"), is_memory = is_set("is_memory");
            lua_getfield(L, -1, "message");
            found = {text_at(L, -1), full_stack, is_memory};
        }
    } else if (message.ends_with("not enough memory")) {  // while a state is made there is no table yet
        found = {message, false, true};
    }
    lua_settop(L, top);
    return found;
}

// Returns the remedy added to a LuaJIT message with a known ending; empty for others.
std::string remedy_of(lua_State* L, const std::string& message)
{
    const int top = lua_gettop(L);
    std::string remedy;
    const std::size_t begin = message.rfind('(');
    lua_getfield(L, LUA_REGISTRYINDEX, engine_errors);
    if (lua_istable(L, -1) && begin != std::string::npos) {
        lua_getfield(L, -1, "endings");
        if (lua_istable(L, -1)) lua_getfield(L, -1, message.c_str() + begin);
        if (lua_isstring(L, -1)) remedy = "; " + text_at(L, -1);
    }
    lua_settop(L, top);
    return remedy;
}

std::string message_of(lua_State* L, int index)
{
    if (lua_type(L, index) == LUA_TSTRING || lua_type(L, index) == LUA_TNUMBER) return text_at(L, index);
    if (lua_isnil(L, index)) return "the script raised an error without a message";
    return fmt::format("the script raised an error with a {} instead of a message", luaL_typename(L, index));
}

std::string shown(const Location& location) { return fmt::format("{}:{}", location.file, location.line); }

// Returns the line of the error itself if it is graph code, else the nearest line of graph code that led there; empty
// if there is none. Removes the position that Lua's `error` prepends to the message.
std::string find_location(lua_State* L, std::string& message)
{
    const Location& tail_call = State::of(L).tail_call;
    std::string location;
    lua_Debug info;
    for (int level = 1; lua_getstack(L, level, &info); ++level) {
        lua_getinfo(L, "Sl", &info);
        if (location.empty() && is_run_body(L, info) && tail_call.line > 0) location = shown(tail_call);
        if (info.currentline < 0) continue;
        const std::string prefix = fmt::format("{}:{}: ", info.short_src, info.currentline);
        const bool own = message.starts_with(prefix);
        if (own) message.erase(0, prefix.size());
        if (is_graph_code(info) && (location.empty() || own)) location = shown({info.source + 1, info.currentline});
        if (own && is_graph_code(info)) break;
        if (!location.empty() && level > levels_searched) break;
    }
    return location.empty() && tail_call.line > 0 ? shown(tail_call) : location;
}

void set_field(lua_State* L, int table, Description field, const std::string& text)
{
    lua_pushlstring(L, text.data(), text.size());
    lua_rawseti(L, table, field);
}

std::string get_field(lua_State* L, int table, Description field)
{
    lua_rawgeti(L, table, field);
    const std::string text = text_at(L, -1);
    lua_pop(L, 1);
    return text;
}

// Parses "file:12" into a Location.
Location parse_location(const std::string& location)
{
    const std::size_t colon = location.rfind(':');
    if (colon == std::string::npos) return {};
    return {location.substr(0, colon), std::atoi(location.c_str() + colon + 1)};
}

// Returns the error at its position. Lua has positions only as the beginning of a message, "file:12: text": such a
// position, as in messages of the compiler and of nodes, takes precedence over `location`.
Error with_location(const std::string& message, const std::string& location, ErrorKind kind)
{
    const std::size_t end = message.find(": ");
    const std::size_t colon = end == std::string::npos ? end : message.rfind(':', end - 1);
    if (colon != std::string::npos && colon + 1 < end && message.find_first_not_of("0123456789", colon + 1) == end)
        return Error(message.substr(end + 2), kind).at(parse_location(message.substr(0, end)));
    if (!location.empty()) return Error(message, kind).at(parse_location(location));
    return Error(message, kind);
}

}  // namespace

int describe_error(lua_State* L)
{
    std::string message = message_of(L, 1);
    const std::string location = find_location(L, message);
    const std::optional<EngineError> of_engine = engine_error(L, message);
    message = of_engine ? of_engine->message : message + remedy_of(L, message);
    std::string trace;
    if (!of_engine || !of_engine->full_stack) {
        luaL_traceback(L, L, nullptr, 1);
        trace = text_at(L, -1);
    }
    lua_settop(L, 0);
    lua_createtable(L, 4, 0);
    set_field(L, 1, message_field, message);
    set_field(L, 1, location_field, location);
    set_field(L, 1, trace_field, trace);
    lua_pushboolean(L, of_engine && of_engine->is_memory);
    lua_rawseti(L, 1, is_memory_field);
    return 1;
}

Error take_error(lua_State* L, int status)
{
    const int top = lua_gettop(L);
    std::string message, location, trace;
    bool is_memory = status == LUA_ERRMEM;
    if (lua_istable(L, top)) {
        message = get_field(L, top, message_field);
        location = get_field(L, top, location_field);
        trace = get_field(L, top, trace_field);
        lua_rawgeti(L, top, is_memory_field);
        is_memory = is_memory || lua_toboolean(L, -1) != 0;
    } else {  // no handler was called, or it failed: memory or stack ran out while describing the error
        message = lua_isstring(L, top) ? text_at(L, top) : "an unknown error";
        if (const auto of_engine = engine_error(L, message)) {
            message = of_engine->message;
            is_memory = is_memory || of_engine->is_memory;
        }
    }
    lua_settop(L, top - 1);
    const ErrorKind kind = is_memory ? ErrorKind::OutOfMemory : State::of(L).kind_of(message);
    return with_location(message, location, kind).with_trace(trace);
}

void set_engine_errors(lua_State* L) { lua_setfield(L, LUA_REGISTRYINDEX, engine_errors); }

int guarded(lua_State* L, int (*f)(State& state))
{
    State& state = State::of(L);
    std::string message;
    try {
        const State::InCoroutine running(state, L);
        return f(state);
    } catch (const Error& error) {  // its text has the place and the node that it knows
        message = error.what();
        state.pass(error);
    } catch (const std::bad_alloc&) {
        const Error error("out of memory", ErrorKind::OutOfMemory);
        message = error.what();
        state.pass(error);
    } catch (const std::exception& error) {
        message = error.what();
    }
    state.leave_if_broken();
    lua_pushlstring(L, message.data(), message.size());
    return lua_error(L);
}

bool is_graph_code(const lua_Debug& info) { return info.source[0] == '@'; }

Location where(const State& state)
{
    lua_Debug info;
    for (int level = 0; lua_getstack(state.lua(), level, &info); ++level) {
        lua_getinfo(state.lua(), "Sl", &info);
        if (info.currentline > 0 && is_graph_code(info)) return {info.source + 1, info.currentline};
        if (is_run_body(state.lua(), info) && state.tail_call.line > 0) break;
    }
    return state.tail_call;
}

Location location_of_function(lua_State* L, int index)
{
    lua_Debug info;
    lua_pushvalue(L, index);
    lua_getinfo(L, ">S", &info);
    return {is_graph_code(info) ? info.source + 1 : "", info.linedefined};
}

int run_body(lua_State* L)
{
    State& state = State::of(L);
    struct Ending {
        Location& location;
        Location before;
        ~Ending() { location = before; }
    } const ending{state.tail_call,
                   std::exchange(state.tail_call, {lua_tostring(L, 2), static_cast<int>(lua_tointeger(L, 3))})};
    lua_remove(L, 3);
    lua_remove(L, 2);
    lua_call(L, lua_gettop(L) - 1, 1);
    return 1;
}

bool is_run_body(lua_State* L, lua_Debug& info)
{
    if (*info.what != 'C') return false;
    lua_getinfo(L, "f", &info);
    const bool it_is = lua_tocfunction(L, -1) == run_body;
    lua_pop(L, 1);
    return it_is;
}

}  // namespace rapid
