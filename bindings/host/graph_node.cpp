#include "bindings/host/graph_node.h"

#include <fmt/format.h>

#include <lua.hpp>

#include "bindings/host/construct.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/script_error.h"
#include "bindings/host/script_type.h"
#include "bindings/host/values.h"
#include "runtime/base/at_node.h"
#include "runtime/graph/registry.h"

namespace rapid {
namespace {

// Replaces the table at `index` by a copy, so that the caller's table is not changed.
void copy_table(lua_State* L, int index)
{
    lua_newtable(L);
    lua_pushnil(L);
    while (lua_next(L, index)) {
        lua_pushvalue(L, -2);
        lua_insert(L, -2);
        lua_rawset(L, -4);
    }
    lua_replace(L, index);
}

// Takes the kernels from the table of arguments at `index`. They are numbered in the order of the type's parameters,
// equally in every state. Returns the kernels by parameter in the main state.
std::map<std::string, ObjectPtr> take_kernels(State& state, const NodeType& type, int index)
{
    std::map<std::string, ObjectPtr> kernels;
    lua_State* L = state.lua();
    ScriptHost& host = state.host();
    for (const Param& param : type.params) {
        const bool of_the_set = param.type == Kernel::set_function_type;
        // "function of a point", alone or as one of several types.
        if (!of_the_set && !param.type.ends_with(PointFunction::param_type)) continue;
        if (param.internal)
            push_kernel_of_type(state, type.name);
        else
            lua_getfield(L, index, param.name.c_str());
        if (!lua_isfunction(L, -1)) {
            lua_pop(L, 1);
            continue;
        }
        KernelSource source;
        source.location = location_of_function(L, -1);
        source.number = state.add_kernel();
        source.of_the_set = of_the_set;
        source.may_compute_groups = param.internal && names_groups(type);
        if (state.is_main()) {
            kernels[param.name] = host.kernels.emplace_back(std::make_shared<Kernel>(host, source));
        } else if (source.number >= host.kernels.size()) {
            throw Error(
                "the graph file made more kernels in a worker than in the first run; it must do the same each time");
        }
        if (!param.internal) {
            lua_pushnil(L);
            lua_setfield(L, index, param.name.c_str());
        }
    }
    return kernels;
}

// Adds to the number of nodes that share this stem in the graph, and returns the sum.
int count_nodes(lua_State* L, const std::string& stem, int more)
{
    constexpr char counts[] = "rapid.node_counts";  // registry key; counts by stem
    lua_getfield(L, LUA_REGISTRYINDEX, counts);
    if (lua_isnil(L, -1)) {
        lua_pop(L, 1);
        lua_newtable(L);
        lua_pushvalue(L, -1);
        lua_setfield(L, LUA_REGISTRYINDEX, counts);
    }
    lua_getfield(L, -1, stem.c_str());
    const int count = static_cast<int>(lua_tointeger(L, -1)) + more;
    lua_pushinteger(L, count);
    lua_setfield(L, -3, stem.c_str());
    lua_pop(L, 2);
    return count;
}

// Returns the variable of graph code that holds the value at `index`; empty if none does.
std::string variable_of(lua_State* L, int index)
{
    lua_Debug info;
    std::string found;
    const auto take = [&](const char* name) {
        if (name[0] != '(' && lua_rawequal(L, -1, index)) found = name;
        lua_pop(L, 1);
    };
    for (int level = 0; found.empty() && lua_getstack(L, level, &info); ++level) {
        lua_getinfo(L, "Sf", &info);
        if (is_graph_code(info)) {
            for (int i = 1; const char* name = lua_getlocal(L, &info, i); ++i) take(name);
            for (int i = 1; const char* name = lua_getupvalue(L, -1, i); ++i) take(name);
        }
        lua_pop(L, 1);
    }
    return found;
}

// Returns a value as a scene writes it: with all entries of tables, of which messages show only some.
std::string written(const Value& value)
{
    const Table* table = value.table();
    if (!table) return describe(value);
    std::vector<std::string> entries;
    for (const Value& entry : table->list) entries.push_back(written(entry));
    for (const auto& [key, entry] : table->numbered) entries.push_back(fmt::format("[{}] = {}", key, written(entry)));
    for (const auto& [name, entry] : table->named) entries.push_back(fmt::format("{} = {}", name, written(entry)));
    return fmt::format("{{{}}}", fmt::join(entries, ", "));
}

// Refuses `:emit { source = chain }` and shows how :spawn takes the arguments, which follow the type on the stack. Also
// refuses `inherit`, which is not similar enough to inherit_velocity to be suggested.
void refuse_former_names(State& state)
{
    lua_State* L = state.lua();
    lua_getfield(L, 2, "source");
    const bool is_chain = std::dynamic_pointer_cast<const NodeHandle>(to_object(state, -1)) != nullptr;
    const std::string chain = is_chain ? variable_of(L, lua_gettop(L)) : "";
    lua_pop(L, 1);
    if (!is_chain) {
        lua_getfield(L, 2, "inherit");
        const bool is_given = !lua_isnil(L, -1);
        lua_pop(L, 1);
        if (is_given) throw Error("unknown parameter \"inherit\"; did you mean \"inherit_velocity\"?");
        return;
    }
    std::map<std::string, std::string> strings;
    for (lua_pushnil(L); lua_next(L, 2); lua_pop(L, 1)) {
        if (lua_type(L, -2) != LUA_TSTRING) continue;
        const std::string name = text_at(L, -2);
        const bool is_share = name == "inherit" && !lua_istable(L, -1) && lua_type(L, -1) != LUA_TSTRING;
        const bool is_function = lua_isfunction(L, -1);
        const std::string variable = is_function || lua_isuserdata(L, -1) ? variable_of(L, lua_gettop(L)) : "";
        strings[is_share ? "inherit_velocity" : name] = !variable.empty() ? variable
                                                        : is_function     ? "function(...) ... end"
                                                                          : written(to_value(state, -1));
    }
    strings.erase("source");
    std::string call = fmt::format(":spawn {{ from = {}", chain.empty() ? "chain" : chain);
    for (const auto& [name, text] : strings) call += fmt::format(", {} = {}", name, text);
    Error error(fmt::format("source is a node; :spawn emits from the points of a node: write {} }}", call));
    lua_getfield(L, 2, "name");
    if (lua_type(L, -1) == LUA_TSTRING) error.in_node(text_at(L, -1));
    throw error;
}

// Sets the arguments and, if given, the name.
void take_options(Node& node, const Table& options)
{
    const NodeType& type = *node.type;
    check_named(options);
    node.arguments = options.named;
    for (const Param& param : type.params)
        if (param.internal && node.arguments.count(param.name))
            throw Error(
                fmt::format("unknown parameter \"{}\"{}", param.name, did_you_mean(param.name, type.param_names())));
    const auto named = node.arguments.find("name");
    if (named == node.arguments.end() || type.find("name")) return;
    const std::string* name = named->second.get<std::string>();
    if (!name || name->empty()) throw Error(fmt::format("name = {}; it must be a string", describe(named->second)));
    node.name = *name;
    node.arguments.erase(named);
}

// Sets the inputs, which follow the type and the arguments on the stack.
void take_inputs(State& state, Node& node)
{
    for (int i = 3; i <= lua_gettop(state.lua()); ++i) {
        const auto input = std::dynamic_pointer_cast<const NodeHandle>(to_object(state, i));
        if (!input)
            throw Error(fmt::format("input {} is {}; it must be a node: write node:{}{{ ... }}", i - 2,
                                    describe(to_value(state, i)), node.type->name));
        node.inputs.push_back(input->node);
    }
}

}  // namespace

int make_node(State& state)
{
    ScriptHost& host = state.host();
    const NodeType& type = host.registry.at(text_at(state.lua(), 1));
    if (state.is_loaded())
        throw Error(fmt::format(":{} is called while a frame runs; make nodes in the graph's body", type.name));

    const std::string& stem = type.counted_as.empty() ? type.name : type.counted_as;
    const std::string number_name = fmt::format("{}{}", stem, count_nodes(state.lua(), stem, 0) + 1);
    copy_table(state.lua(), 2);
    if (type.name == "emit") name_errors(number_name, where(state), [&] { refuse_former_names(state); });
    const std::map<std::string, ObjectPtr> kernels = take_kernels(state, type, 2);
    return construct(state, [&]() -> ObjectPtr {
        auto node = make_node();
        node->type = &type;
        node->location = where(state);
        node->serial = host.graph.nodes.size();
        node->name = number_name;
        name_errors(node->name, node->location, [&] {
            take_options(*node, *table_at(state, 2));
            for (const auto& [param, kernel] : kernels) node->arguments[param] = Value(kernel);
            take_inputs(state, *node);
        });
        host.graph.nodes.push_back(node);
        count_nodes(state.lua(), stem, 1);
        return std::make_shared<NodeHandle>(node);
    });
}

// Returns true if the type exists. A Lua type must also be defined in this state, which then has its kernel.
int has_type(State& state)
{
    lua_State* L = state.lua();
    const NodeType* type = state.host().registry.find(text_at(state.lua(), 1));
    bool known = type != nullptr;
    if (known && !type->defined_in.empty()) {
        push_kernel_of_type(state, type->name);
        known = !lua_isnil(L, -1);
        lua_pop(L, 1);
    }
    lua_pushboolean(L, known);
    return 1;
}

// Raises an error with the nearest name, including those of shipped types, which are loaded on first use.
int unknown_type(State& state)
{
    const Registry& registry = state.host().registry;
    const std::string name = text_at(state.lua(), 1);
    std::vector<std::string> names = shipped_nodes();
    for (const NodeType* type : registry.types()) names.push_back(type->name);
    if (const std::string nearest = did_you_mean(name, names); !nearest.empty())
        throw Error(fmt::format("unknown node \"{}\"{}", name, nearest));
    registry.at(name);
    return 0;
}

}  // namespace rapid
