#include "bindings/host/script_function.h"

#include <fmt/format.h>

#include <lua.hpp>
#include <utility>

#include "bindings/host/script_host.h"
#include "bindings/host/script_place.h"
#include "bindings/host/state.h"
#include "bindings/host/values.h"

namespace rapid {
namespace {

class ScriptFunction : public FrameFunction {
public:
    ScriptFunction(State& state, int index) : state_(state), location_(place_of_function(state.lua(), index))
    {
        if (location_.file.empty()) location_ = {};
        lua_pushvalue(state.lua(), index);
        reference_ = luaL_ref(state.lua(), LUA_REGISTRYINDEX);
    }

    Value call(const Frame& frame) const override
    {
        lua_State* L = state_.lua();
        const Watchdog::Section section(state_.host().watchdog,
                                        fmt::format("{}:{}: a parameter's function", location_.file, location_.line));
        const MakerCache::Call remembered(cache_, state_.host().maker_cache);
        state_.push_entry("call");
        lua_rawgeti(L, LUA_REGISTRYINDEX, reference_);
        lua_pushnumber(L, frame.number);
        lua_pushnumber(L, frame.time);
        lua_pushnumber(L, frame.dt);
        try {
            state_.call(4, 1);
        } catch (Error& error) {
            error.at(location_);
            throw;
        }
        Value result = to_value(state_, -1);
        lua_pop(L, 1);
        return result;
    }

private:
    State& state_;
    Location location_;
    int reference_ = 0;
    mutable MakerCache cache_;  // asked on one thread
};

}  // namespace

std::shared_ptr<const FrameFunction> script_function(State& state, int index)
{
    return std::make_shared<ScriptFunction>(state, index);
}

}  // namespace rapid
