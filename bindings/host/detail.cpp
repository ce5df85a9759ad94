#include "bindings/host/detail.h"

#include <fmt/format.h>

#include <lua.hpp>
#include <numeric>

#include "bindings/host/kernel.h"
#include "bindings/host/kernel_pass.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/script_error.h"
#include "bindings/host/script_host.h"
#include "bindings/host/state.h"
#include "bindings/host/values.h"
#include "runtime/points/attribute_like.h"

namespace rapid {
namespace {

// Calls the function. Leaves the indices (from 0) of the killed points and the detail values on the stack.
void call_function(const Kernel& function, const PointSet& points, const Evaluation& now,
                   const KernelArguments& arguments)
{
    State& state = function.host().main();
    lua_State* L = state.lua();
    state.push_entry("detail");
    state.push_kernel(function.source.number);
    for (const double x : {now.frame.number, now.frame.time, now.frame.dt}) lua_pushnumber(L, x);
    push(state, arguments.values);
    lua_pushnumber(L, static_cast<double>(points.size()));
    lua_pushlightuserdata(L, const_cast<std::uint64_t*>(&now.random.value));
    push(state, values_of(points.details));
    try {
        state.call(8, 2);
    } catch (const Error& error) {
        throw error.reworded(fmt::format("{} (frame {})", error.message(), now.frame.number))
            .at(function.source.location)
            .in_node(now.node);
    }
}

void keep_details(PointSet& points, const Table& values)
{
    for (const auto& [name, value] : values.named) {
        if (const double* number = value.get<double>())
            points.details[name] = *number;
        else if (const Vec3d* vector = value.get<Vec3d>())
            points.details[name] = *vector;
    }
}

void number_newborn(Flow& flow, std::size_t before)
{
    const std::size_t born = flow.points.size() - before;
    if (born == 0) return;
    const std::span<std::int64_t> ids = flow.points.id().write().subspan(before);
    std::iota(ids.begin(), ids.end(), flow.simulation->next_id);
    flow.simulation->next_id += static_cast<std::int64_t>(born);
}

// Removes the points in the list at `index`, which holds indices from 0. Returns their number.
std::size_t remove_killed(PointSet& points, lua_State* L, int index)
{
    const auto dead = static_cast<std::size_t>(lua_objlen(L, index));
    if (dead == 0) return 0;
    std::vector<std::uint8_t> keep(points.size(), 1);
    for (std::size_t k = 0; k < dead; ++k) {
        lua_rawgeti(L, index, static_cast<int>(k) + 1);
        keep[static_cast<std::size_t>(lua_tonumber(L, -1))] = 0;
        lua_pop(L, 1);
    }
    points.keep(keep);
    return dead;
}

}  // namespace

std::map<std::string, Value> values_of(const std::map<std::string, DetailValue, std::less<>>& details)
{
    std::map<std::string, Value> values;
    for (const auto& [name, detail] : details)
        values[name] = std::visit([](const auto& value) { return Value(value); }, detail);
    return values;
}

void run_detail(const Kernel& function, Flow& flow, const Evaluation& now, const KernelArguments& arguments)
{
    ScriptHost& host = function.host();
    State& state = host.main();
    const Watchdog::Section section(host.watchdog, KernelCaller(now).title());
    const DetailRun run(state, flow.points, flow.simulation->record.get());
    const std::size_t before = flow.points.size();
    call_function(function, flow.points, now, arguments);

    const int details = lua_gettop(state.lua()), killed = details - 1;
    keep_details(flow.points, *to_value(state, details).table());
    number_newborn(flow, before);
    now.figures.born += flow.points.size() - before;
    now.figures.died += remove_killed(flow.points, state.lua(), killed);
}

namespace {

constexpr char run_in_registry[] = "rapid.detail";  // registry key of the current run

DetailRun& detail_run_of(State& state)
{
    lua_State* L = state.lua();
    lua_getfield(L, LUA_REGISTRYINDEX, run_in_registry);
    auto* run = static_cast<DetailRun*>(lua_touserdata(L, -1));
    lua_pop(L, 1);
    if (!run) throw Error("points can't be used outside the :detail function that received them");
    return *run;
}

// native.column(name, writable): returns pointer, stride in scalars, type.
int column(State& state)
{
    lua_State* L = state.lua();
    DetailRun& detail = detail_run_of(state);
    const std::string name = text_at(state.lua(), 1);
    AnyColumn* any = lua_type(L, 1) == LUA_TSTRING ? detail.points.find(name) : nullptr;
    if (!any) throw Error(no_attribute(name, detail.points.column_names()));
    const bool writable = lua_toboolean(L, 2) != 0;
    std::visit(
        [&]<class T>(Column<T>& values) {
            if (writable) values.write();
            const Strided<T> memory = std::as_const(values).read();
            lua_pushlightuserdata(L, const_cast<T*>(memory.data));
            lua_pushnumber(L, static_cast<double>(components_of<T> * memory.stride));
        },
        *any);
    push_text(L, type_name(type_of(*any)));
    return 3;
}

// native.has(name): returns true if the set has the attribute.
int has(State& state)
{
    lua_pushboolean(state.lua(), detail_run_of(state).points.has(text_at(state.lua(), 1)));
    return 1;
}

// native.group(name, writable): returns pointer and stride, or nothing if the group does not exist and is only read.
int group(State& state)
{
    lua_State* L = state.lua();
    DetailRun& detail = detail_run_of(state);
    const std::string name = text_at(state.lua(), 1);
    if (lua_toboolean(L, 2)) detail.points.group(name).write();
    const Column<std::uint8_t>* members = detail.points.find_group(name);
    if (!members) return 0;
    const Strided<std::uint8_t> memory = members->read();
    lua_pushlightuserdata(L, const_cast<std::uint8_t*>(memory.data));
    lua_pushnumber(L, static_cast<double>(memory.stride));
    return 2;
}

// native.append(n, dt): appends n points. If dt is given, makes the column dt, with the frame's length as default.
int append(State& state)
{
    lua_State* L = state.lua();
    DetailRun& detail = detail_run_of(state);
    if (!lua_isnoneornil(L, 2)) detail.points.add({"dt", static_cast<float>(lua_tonumber(L, 2))});
    detail.points.append(static_cast<std::size_t>(lua_tonumber(L, 1)));
    detail.changed();
    return 0;
}

// native.neighbours(index, radius): returns the indices, from 1, of the others.
int neighbours(State& state)
{
    lua_State* L = state.lua();
    DetailRun& detail = detail_run_of(state);
    const auto index = static_cast<std::uint32_t>(lua_tonumber(L, 1));
    const double radius = lua_tonumber(L, 2);
    const Strided<Vec3f> P = std::as_const(detail.points).P().read();
    auto grid = detail.neighbours.find(radius);
    if (grid == detail.neighbours.end()) {
        std::vector<Vec3f> positions(detail.points.size());
        for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = P[i];
        grid = detail.neighbours.try_emplace(radius, positions, radius).first;
    }
    std::vector<std::uint32_t> found;
    grid->second.find(P[index].cast<double>(), found);
    lua_createtable(L, static_cast<int>(found.size()), 0);
    int n = 0;
    for (const std::uint32_t i : found) {
        if (i == index) continue;
        lua_pushnumber(L, i + 1.0);
        lua_rawseti(L, -2, ++n);
    }
    return 1;
}

// native.reorder(indices from 1): reorders the points.
int reorder(State& state)
{
    lua_State* L = state.lua();
    DetailRun& detail = detail_run_of(state);
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

using Entry = std::map<std::string, Value>;

Value list_of(std::vector<Value> entries)
{
    auto list = std::make_shared<Table>();
    list->list = std::move(entries);
    return Value(std::shared_ptr<const Table>(std::move(list)));
}
Value entry_of(Entry values)
{
    auto entry = std::make_shared<Table>();
    entry->named = std::move(values);
    return Value(std::shared_ptr<const Table>(std::move(entry)));
}
Value vector_of(const Vec3f& v) { return Value(Vec3d(v.cast<double>())); }

std::vector<Value> deaths_in(const PointSet& dead, const std::vector<double>& times)
{
    std::vector<Value> deaths;
    for (std::size_t i = 0; i < dead.size(); ++i)
        deaths.push_back(entry_of({{"id", static_cast<double>(dead.id()[i])},
                                   {"P", vector_of(dead.P()[i])},
                                   {"v", vector_of(dead.v()[i])},
                                   {"time", times[i]}}));
    return deaths;
}

// native.events(): returns the last step's events, { hits = {...}, deaths = {...}, births = {...} }.
int events(State& state)
{
    const StepRecord* record = detail_run_of(state).record;
    if (!record) throw Error("points.events needs a :solve at the end of the chain; end it with :solve {}");
    const PointSet& before = record->before;
    std::vector<Value> hits, births;
    for (const LoggedHit& hit : record->hits)
        hits.push_back(entry_of({{"id", static_cast<double>(before.id()[hit.point])},
                                 {"P", vector_of(hit.P)},
                                 {"N", vector_of(hit.n)},
                                 {"v", vector_of(hit.v1)},
                                 {"time", hit.time},
                                 {"speed", static_cast<double>(hit.speed)},
                                 {"impulse", static_cast<double>(hit.impulse)}}));
    const Column<float>* dt = before.find<float>("dt");
    for (std::size_t i = 0; i < before.size(); ++i) {
        if (before.id()[i] < record->first_new) continue;
        births.push_back(entry_of({{"id", static_cast<double>(before.id()[i])},
                                   {"P", vector_of(before.P()[i])},
                                   {"v", vector_of(before.v()[i])},
                                   {"time", record->time - (dt ? static_cast<double>((*dt)[i]) : record->h)}}));
    }
    std::vector<Value> deaths = deaths_in(record->killed, record->killed_at);
    for (Value& old : deaths_in(record->old, record->old_at)) deaths.push_back(std::move(old));
    push(state, entry_of({{"hits", list_of(std::move(hits))},
                          {"deaths", list_of(std::move(deaths))},
                          {"births", list_of(std::move(births))}}));
    return 1;
}

}  // namespace

DetailRun::DetailRun(State& state, PointSet& of, const StepRecord* of_step)
    : points(of), record(of_step), state_(state), top_(lua_gettop(state.lua()))
{
    ++state_.detail_serial;
    lua_pushlightuserdata(state_.lua(), this);
    lua_setfield(state_.lua(), LUA_REGISTRYINDEX, run_in_registry);
}

DetailRun::~DetailRun()
{
    ++state_.detail_serial;
    lua_settop(state_.lua(), top_);
    lua_pushnil(state_.lua());
    lua_setfield(state_.lua(), LUA_REGISTRYINDEX, run_in_registry);
}

void push_detail_natives(State& state)
{
    lua_State* L = state.lua();
    constexpr luaL_Reg functions[] = {{"column", native<column>},         {"has", native<has>},
                                      {"group", native<group>},           {"append", native<append>},
                                      {"neighbours", native<neighbours>}, {"reorder", native<reorder>},
                                      {"events", native<events>}};
    lua_newtable(L);
    for (const luaL_Reg& f : functions) {
        lua_pushcfunction(L, f.func);
        lua_setfield(L, -2, f.name);
    }
    lua_pushlightuserdata(L, &state.detail_serial);
    lua_setfield(L, -2, "serial");
}

}  // namespace rapid
