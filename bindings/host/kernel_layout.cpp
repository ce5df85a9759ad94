#include "bindings/host/kernel_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <lua.hpp>

#include "bindings/host/chunk.h"
#include "bindings/host/kernel_lanes.h"
#include "bindings/host/lua_text.h"
#include "runtime/base/memory_budget.h"

namespace rapid {
namespace {

void set_text(lua_State* L, const char* field, const std::string& text)
{
    push_text(L, text);
    lua_setfield(L, -2, field);
}

void set_flag(lua_State* L, const char* field, bool flag)
{
    lua_pushboolean(L, flag);
    lua_setfield(L, -2, field);
}

void set_entries(lua_State* L, const char* field, const std::vector<KernelLayout::Entry>& entries)
{
    lua_createtable(L, static_cast<int>(entries.size()), 0);
    for (std::size_t i = 0; i < entries.size(); ++i) {
        lua_createtable(L, 0, 4);
        set_text(L, "name", entries[i].name);
        set_text(L, "type", entries[i].type);
        set_flag(L, "uniform", entries[i].uniform);
        set_flag(L, "writable", entries[i].writable);
        lua_rawseti(L, -2, static_cast<int>(i) + 1);
    }
    lua_setfield(L, -2, field);
}

void push_layout(lua_State* L, const KernelLayout& layout)
{
    lua_newtable(L);
    set_entries(L, "columns", layout.columns);
    set_entries(L, "groups", layout.groups);
    set_flag(L, "predicate", layout.predicate);
    set_flag(L, "masked", layout.masked);
    set_flag(L, "action", layout.action);
}

// Pushes a chunk with room for the pointers to its columns and groups. It lives as long as the state.
rapid_chunk* push_chunk(lua_State* L, std::size_t pointers)
{
    auto* chunk = static_cast<rapid_chunk*>(lua_newuserdata(L, sizeof(rapid_chunk) + pointers * sizeof(void*)));
    *chunk = {};
    chunk->at = -1;
    lua_pushvalue(L, -1);
    luaL_ref(L, LUA_REGISTRYINDEX);
    return chunk;
}

}  // namespace

void KernelLayout::make_writable(PointSet& points) const
{
    double bytes = 0;  // bytes of columns that were uniform before
    std::size_t expanded = 0;
    const auto add = [&]<class T>(const Column<T>& column) {
        if (!column.is_uniform()) return;
        bytes += static_cast<double>(points.size()) * sizeof(T);
        ++expanded;
    };
    for (const Entry& entry : columns)
        if (entry.writable) std::visit(add, *points.find(entry.name));
    for (const Entry& entry : groups)
        if (entry.writable) add(points.group(entry.name));
    if (!fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("{} attributes and groups of {} points", expanded, points.size()), bytes,
                              "write fewer in the kernel");
    for (const Entry& entry : columns)
        if (entry.writable) std::visit([](auto& column) { column.write(); }, *points.find(entry.name));
    for (const Entry& entry : groups)
        if (entry.writable) points.group(entry.name).write();
}

void KernelLayout::settle(const PointSet& points, bool mask)
{
    masked = mask;
    // Every writable column now has a value for each point.
    for (Entry& e : columns)
        e.uniform = !e.writable && std::visit([](const auto& c) { return c.is_uniform(); }, *points.find(e.name));
    for (Entry& e : groups) e.uniform = !e.writable && points.find_group(e.name)->is_uniform();
    make_key();
}

void KernelLayout::settle_action(bool reads_force, bool writes_force)
{
    action = true;
    std::erase_if(columns, [](const Entry& e) { return e.name == "force"; });
    for (Entry& entry : columns)
        if (entry.name == "P" || entry.name == "v") entry.type = "vec3d", entry.uniform = false;
    if (writes_force || reads_force) columns.push_back({"force", "vec3d", writes_force});
    make_key();
}

void KernelLayout::make_key()
{
    key = fmt::format("{}{}{}", predicate ? 'p' : '-', masked ? 'm' : '-', action ? 'a' : '-');
    const auto marks = [](const Entry& e) { return e.writable ? "!" : e.uniform ? "=" : ""; };
    for (const Entry& e : columns) key += fmt::format(" {}:{}{}", e.name, e.type, marks(e));
    for (const Entry& e : groups) key += fmt::format(" ({}{})", e.name, marks(e));
}

State::Runner& runner_for(State& state, std::size_t kernel, const KernelLayout& layout)
{
    std::vector<State::Runner>& runners = state.runners[kernel];
    for (State::Runner& runner : runners)
        if (runner.layout == layout.key) return runner;

    lua_State* L = state.lua();
    state.push_entry("runner");
    state.push_kernel(kernel);
    push_layout(L, layout);
    State::Runner runner;
    runner.layout = layout.key;
    runner.chunk = push_chunk(L, layout.columns.size() + layout.groups.size());
    state.call(3, 3);
    runner.translate = luaL_ref(L, LUA_REGISTRYINDEX);
    runner.set_params = luaL_ref(L, LUA_REGISTRYINDEX);
    runner.run = luaL_ref(L, LUA_REGISTRYINDEX);
    return runners.emplace_back(std::move(runner));
}

}  // namespace rapid
