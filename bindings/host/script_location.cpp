#include "bindings/host/script_location.h"

#include <lua.hpp>
#include <utility>

#include "bindings/host/state.h"

namespace rapid {

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
