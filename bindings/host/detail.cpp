#include "bindings/host/detail.h"

#include <fmt/format.h>

#include <algorithm>
#include <lua.hpp>
#include <map>
#include <numeric>

#include "bindings/host/kernel.h"
#include "bindings/host/script_host.h"
#include "bindings/host/state.h"
#include "runtime/points/neighbours.h"

namespace rapid {
namespace {

// The set that a function runs on; of the main state, one at a time.
struct Detail {
    PointSet& points;
    std::map<double, std::unique_ptr<const Neighbours>> neighbours;  // by radius, of the places when first asked for

    void changed() { neighbours.clear(); }
};

constexpr char current[] = "rapid.detail";  // in the registry: the Detail that is running

Detail& detail_of(State& state)
{
    lua_State* L = state.lua();
    lua_getfield(L, LUA_REGISTRYINDEX, current);
    auto* detail = static_cast<Detail*>(lua_touserdata(L, -1));
    lua_pop(L, 1);
    if (!detail) throw Error("points can't be used outside the :detail function that they were given to");
    return *detail;
}

std::string text_at(State& state, int index)
{
    std::size_t size = 0;
    const char* text = lua_tolstring(state.lua(), index, &size);
    return text ? std::string(text, size) : std::string();
}

// native.column(name, writable): pointer, stride in scalars, type.
int column(State& state)
{
    lua_State* L = state.lua();
    Detail& detail = detail_of(state);
    const std::string name = text_at(state, 1);
    AnyColumn* any = lua_type(L, 1) == LUA_TSTRING ? detail.points.find(name) : nullptr;
    if (!any) throw Error(fmt::format("no attribute \"{}\"{}", name, did_you_mean(name, detail.points.column_names())));
    const bool writable = lua_toboolean(L, 2) != 0;
    std::visit(
        [&]<class T>(Column<T>& values) {
            if (writable) values.write();
            constexpr int scalars = std::is_same_v<T, Vec3f> ? 3 : std::is_same_v<T, Quatf> ? 4 : 1;
            const Strided<T> memory = std::as_const(values).read();
            lua_pushlightuserdata(L, const_cast<T*>(memory.data));
            lua_pushnumber(L, static_cast<double>(scalars * memory.stride));
        },
        *any);
    const std::string_view type = type_name(type_of(*any));
    lua_pushlstring(L, type.data(), type.size());
    return 3;
}

// native.has(name)
int has(State& state)
{
    lua_pushboolean(state.lua(), detail_of(state).points.has(text_at(state, 1)));
    return 1;
}

// native.group(name, writable): pointer and stride; nil for a group that is not there, and not to be written.
int group(State& state)
{
    lua_State* L = state.lua();
    Detail& detail = detail_of(state);
    const std::string name = text_at(state, 1);
    if (lua_toboolean(L, 2)) detail.points.group(name).write();
    const Column<std::uint8_t>* members = detail.points.find_group(name);
    if (!members) return 0;
    const Strided<std::uint8_t> memory = members->read();
    lua_pushlightuserdata(L, const_cast<std::uint8_t*>(memory.data));
    lua_pushnumber(L, static_cast<double>(memory.stride));
    return 2;
}

// native.append(n)
int append(State& state)
{
    Detail& detail = detail_of(state);
    detail.points.append(static_cast<std::size_t>(lua_tonumber(state.lua(), 1)));
    detail.changed();
    return 0;
}

// native.neighbours(place, radius): the places, from 1, of the others.
int neighbours(State& state)
{
    lua_State* L = state.lua();
    Detail& detail = detail_of(state);
    const auto place = static_cast<std::uint32_t>(lua_tonumber(L, 1));
    const double radius = lua_tonumber(L, 2);
    const Strided<Vec3f> P = std::as_const(detail.points).P().read();
    auto& grid = detail.neighbours[radius];
    if (!grid) {
        std::vector<Vec3f> places(detail.points.size());
        for (std::size_t i = 0; i < places.size(); ++i) places[i] = P[i];
        grid = index_neighbours(places, radius);
    }
    std::vector<std::uint32_t> found;
    grid->find(P[place].cast<double>(), found);
    lua_createtable(L, static_cast<int>(found.size()), 0);
    int n = 0;
    for (const std::uint32_t i : found) {
        if (i == place) continue;
        lua_pushnumber(L, i + 1.0);
        lua_rawseti(L, -2, ++n);
    }
    return 1;
}

// native.reorder(places from 1)
int reorder(State& state)
{
    lua_State* L = state.lua();
    Detail& detail = detail_of(state);
    std::vector<std::uint32_t> order(detail.points.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        lua_rawgeti(L, 1, static_cast<int>(i) + 1);
        order[i] = static_cast<std::uint32_t>(lua_tonumber(L, -1)) - 1;
        lua_pop(L, 1);
    }
    detail.points.reorder(order);
    detail.changed();
    return 0;
}

template <int (*f)(State&)>
int native(lua_State* L)
{
    return guarded(L, f);
}

void number_newborn(Flow& flow, std::size_t before, double dt)
{
    const std::size_t born = flow.points.size() - before;
    if (born == 0) return;
    const std::span<std::int64_t> ids = flow.points.id().write().subspan(before);
    std::iota(ids.begin(), ids.end(), flow.simulation->next_id);
    flow.simulation->next_id += static_cast<std::int64_t>(born);
    if (auto* own = flow.points.find<float>("dt"); own && !own->is_uniform())
        for (float& t : own->write().subspan(before)) t = static_cast<float>(dt);
}

}  // namespace

Value value_of(const DetailValue& detail)
{
    return std::visit([](const auto& value) { return Value(value); }, detail);
}

void run_detail(const Kernel& function, Flow& flow, const Evaluation& now, const KernelArguments& arguments)
{
    ScriptHost& host = function.host();
    State& state = host.main();
    lua_State* L = state.lua();
    const ScriptHost::Section section(
        host, fmt::format("{}:{}: node \"{}\"", now.location.file, now.location.line, now.node));
    const int top = lua_gettop(L);
    Detail detail{flow.points, {}};
    struct Running {
        State& state;
        int top;
        ~Running()
        {
            ++state.detail_serial;
            lua_State* L = state.lua();
            lua_settop(L, top);
            lua_pushnil(L);
            lua_setfield(L, LUA_REGISTRYINDEX, current);
        }
    } const running{state, top};
    ++state.detail_serial;
    lua_pushlightuserdata(L, &detail);
    lua_setfield(L, LUA_REGISTRYINDEX, current);

    const std::size_t before = flow.points.size();
    Table values, details;
    values.named = arguments.values;
    for (const auto& [name, value] : flow.points.details) details.named[name] = value_of(value);
    state.push_entry("detail");
    state.push_kernel(function.number);
    for (const double x : {now.frame.number, now.frame.time, now.frame.dt}) lua_pushnumber(L, x);
    state.push(Value(std::make_shared<const Table>(std::move(values))));
    lua_pushnumber(L, static_cast<double>(before));
    lua_pushlightuserdata(L, const_cast<std::uint64_t*>(&now.random.value));
    state.push(Value(std::make_shared<const Table>(std::move(details))));
    try {
        state.call(8, 2);
    } catch (const Error& error) {
        const Location where = error.location().file.empty() ? function.location : error.location();
        Error placed(fmt::format("{} (frame {})", error.message(), now.frame.number));
        placed.at(where).in_node(now.node).with_trace(error.trace());
        throw placed;
    }
    const Value left = state.to_value(-1);
    for (const auto& [name, value] : left.table()->named) {
        if (const double* number = value.get<double>())
            flow.points.details[name] = *number;
        else if (const Vec3d* vector = value.get<Vec3d>())
            flow.points.details[name] = *vector;
    }
    number_newborn(flow, before, now.frame.dt);
    now.figures.born += flow.points.size() - before;

    const auto dead = static_cast<std::size_t>(lua_objlen(L, -2));
    if (dead == 0) return;
    std::vector<std::uint8_t> keep(flow.points.size(), 1);
    for (std::size_t k = 0; k < dead; ++k) {
        lua_rawgeti(L, -2, static_cast<int>(k) + 1);
        keep[static_cast<std::size_t>(lua_tonumber(L, -1))] = 0;
        lua_pop(L, 1);
    }
    flow.points.keep(keep);
    now.figures.died += dead;
}

void push_detail_natives(State& state)
{
    lua_State* L = state.lua();
    constexpr luaL_Reg functions[] = {{"column", native<column>},         {"has", native<has>},
                                      {"group", native<group>},           {"append", native<append>},
                                      {"neighbours", native<neighbours>}, {"reorder", native<reorder>}};
    lua_newtable(L);
    for (const luaL_Reg& f : functions) {
        lua_pushcfunction(L, f.func);
        lua_setfield(L, -2, f.name);
    }
    lua_pushlightuserdata(L, &state.detail_serial);
    lua_setfield(L, -2, "serial");
}

}  // namespace rapid
