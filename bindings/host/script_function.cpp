#include "bindings/host/script_function.h"

#include <fmt/format.h>

#include <lua.hpp>
#include <utility>

#include "bindings/host/kernel_analysis.h"
#include "bindings/host/script_host.h"
#include "bindings/host/script_location.h"
#include "bindings/host/state.h"
#include "bindings/host/values.h"
#include "runtime/graph/point_function.h"

namespace rapid {
namespace {

class ScriptFunction : public FrameFunction, public Located {
public:
    ScriptFunction(State& state, int index) : state_(state), location_(location_of_function(state.lua(), index))
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

    Location location() const override { return location_; }

    void refuse_memory() const
    {
        lua_State* L = state_.lua();
        state_.push_entry("remembers");
        lua_rawgeti(L, LUA_REGISTRYINDEX, reference_);
        state_.call(1, 1);
        const StoreOutside found(L);
        lua_pop(L, 1);
        found.refuse();
    }

private:
    State& state_;
    Location location_;
    int reference_ = 0;
    mutable MakerCache cache_;  // used on one thread
};

}  // namespace

std::shared_ptr<const FrameFunction> script_function(State& state, int index)
{
    auto function = std::make_shared<ScriptFunction>(state, index);
    if (ScriptHost& host = state.host(); host.options().keeps_state && state.is_main()) {
        if (state.is_loaded())
            function->refuse_memory();
        else
            host.frame_functions.push_back(function);
    }
    return function;
}

void refuse_memory(const FrameFunction& function)
{
    if (const auto* script = dynamic_cast<const ScriptFunction*>(&function)) script->refuse_memory();
}

}  // namespace rapid
