#include "bindings/host/kernel_analysis.h"

#include <fmt/format.h>

#include <lua.hpp>
#include <vector>

#include "bindings/host/lua_text.h"
#include "bindings/host/state.h"
#include "bindings/host/values.h"
#include "runtime/graph/node_type.h"
#include "runtime/points/point_names.h"

namespace rapid {
namespace {

// Returns the keys of a field of the table at the top of the stack.
std::set<std::string> keys_of(lua_State* L, const char* field)
{
    std::set<std::string> keys;
    lua_getfield(L, -1, field);
    lua_pushnil(L);
    while (lua_next(L, -2)) {
        lua_pop(L, 1);
        keys.insert(lua_tostring(L, -1));
    }
    lua_pop(L, 1);
    return keys;
}

bool flag_of(lua_State* L, const char* field)
{
    lua_getfield(L, -1, field);
    const bool set = lua_toboolean(L, -1) != 0;
    lua_pop(L, 1);
    return set;
}

int number_of(lua_State* L, const char* field)
{
    lua_getfield(L, -1, field);
    const int number = static_cast<int>(lua_tointeger(L, -1));
    lua_pop(L, 1);
    return number;
}

// Returns the number stored under a name in a field of the table at the top of the stack; 0 if there is none.
int number_under(lua_State* L, const char* field, const std::string& name)
{
    lua_getfield(L, -1, field);
    const int line = number_of(L, name.c_str());
    lua_pop(L, 1);
    return line;
}

// The functions below expect the result of lua/bytecode.lua at the top of the stack.

void check_calls(lua_State* L, const Location& location)
{
    const std::vector<std::string> methods = point_names_of(PointName::Method);
    for (const std::string& name : keys_of(L, "calls")) {
        if (name == "neighbours")
            throw Error(
                "p has no method \"neighbours\", because a kernel sees only one point; use points:neighbours(i, "
                "radius) in a :detail, which sees all points")
                .at({location.file, number_under(L, "calls", name)});
        const std::string near = did_you_mean(name, methods);
        const std::string remedy =
            fmt::format("; it has {} and {}", fmt::join(methods.begin(), methods.end() - 1, ", "), methods.back());
        throw Error(fmt::format("p has no method \"{}\"{}", name, near.empty() ? remedy : near))
            .at({location.file, number_under(L, "calls", name)});
    }
}

void check_assignments(lua_State* L, const Location& location)
{
    for (const PointName& known : point_names) {
        const int line = known.read_only ? number_under(L, "writes", std::string(known.name)) : 0;
        if (line > 0)
            throw Error(fmt::format("the kernel assigns p.{}, which is read-only", known.name))
                .at({location.file, line});
    }
}

void check_groups(lua_State* L, const KernelSource& kernel)
{
    const int line = number_of(L, "computed_group");
    if (line > 0 && !kernel.may_compute_groups)
        throw Error(
            "the kernel joins or leaves a group with a computed name; write the name as a constant: p:join \"old\"")
            .at({kernel.location.file, line});
}

std::map<std::string, Location> locations_in(lua_State* L)
{
    std::map<std::string, Location> locations;
    lua_getfield(L, -1, "locations");
    lua_pushnil(L);
    while (lua_next(L, -2)) {
        lua_getfield(L, -1, "source");
        const std::string source = text_at(L, -1);
        lua_pop(L, 1);
        locations[text_at(L, -2)] = {source.substr(source.starts_with('@') ? 1 : 0), number_of(L, "line")};
        lua_pop(L, 1);
    }
    lua_pop(L, 1);
    return locations;
}

}  // namespace

StoreOutside::StoreOutside(lua_State* L)
{
    lua_getfield(L, -1, "stores");
    lua_rawgeti(L, -1, 1);
    if (lua_istable(L, -1)) {
        lua_getfield(L, -1, "message");
        lua_getfield(L, -2, "source");
        message_ = text_at(L, -2);
        const std::string source = text_at(L, -1);
        lua_pop(L, 2);
        location_ = {source.substr(source.starts_with('@') ? 1 : 0), number_of(L, "line")};
    }
    lua_pop(L, 2);
}

void StoreOutside::refuse() const
{
    if (!message_.empty()) throw Error(message_).at(location_);
}

KernelAnalysis analyse_kernel(State& state, const KernelSource& kernel)
{
    lua_State* L = state.lua();
    struct Restored {
        lua_State* L;
        int top;
        ~Restored() { lua_settop(L, top); }
    } const restored{L, lua_gettop(L)};
    state.push_entry("analyse");
    state.push_kernel(kernel.number);
    lua_pushboolean(L, !kernel.of_the_set);
    state.call(2, 1);
    check_calls(L, kernel.location);
    check_assignments(L, kernel.location);
    StoreOutside(L).refuse();
    check_groups(L, kernel);

    KernelAnalysis found;
    found.reads = keys_of(L, "reads");
    found.writes = keys_of(L, "writes");
    found.locations = locations_in(L);
    for (const std::string& name : keys_of(L, "vectors")) found.vectors[name] = number_under(L, "vectors", name);
    found.may = keys_of(L, "may");
    found.may_write = keys_of(L, "may_write");
    found.joins = keys_of(L, "joins");
    found.queries = keys_of(L, "queries");
    found.queries_any_group = flag_of(L, "queries_any_group");
    found.kills = flag_of(L, "kills");
    for (std::set<std::string>* names : {&found.reads, &found.may})
        if (names->count("nage")) names->insert({"age", "life"});
    found.reads_indices =
        kernel.of_the_set ? flag_of(L, "reads_points") : flag_of(L, "reads_indices") || flag_of(L, "computes_names");
    return found;
}

std::optional<std::vector<ObjectPtr>> objects_of(State& state, std::size_t kernel)
{
    lua_State* L = state.lua();
    state.push_entry("objects_of");
    state.push_kernel(kernel);
    state.call(1, 1);
    std::optional<std::vector<ObjectPtr>> objects;
    if (lua_istable(L, -1)) objects.emplace();
    for (int i = 1; objects; ++i) {
        lua_rawgeti(L, -1, i);
        const bool ends = lua_isnil(L, -1);
        const ObjectPtr object = ends ? nullptr : to_object(state, lua_gettop(L));
        lua_pop(L, 1);
        if (ends) break;
        // A node may own this kernel, which must not own the node in turn.
        if (object && !dynamic_cast<const NodeHandle*>(object.get())) objects->push_back(object);
    }
    lua_pop(L, 1);
    return objects;
}

std::string fingerprint_of(State& state, std::size_t kernel)
{
    lua_State* L = state.lua();
    state.push_entry("fingerprint");
    state.push_kernel(kernel);
    state.call(1, 1);
    const std::string fingerprint = text_at(L, -1);
    lua_pop(L, 1);
    return fingerprint;
}

}  // namespace rapid
