#include "bindings/host/detail.h"

#include <fmt/format.h>

#include <lua.hpp>
#include <numeric>

#include "bindings/host/detail_natives.h"
#include "bindings/host/kernel.h"
#include "bindings/host/kernel_pass.h"
#include "bindings/host/script_host.h"
#include "bindings/host/values.h"

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

}  // namespace rapid
