#include "bindings/host/graph_node.h"

#include <fmt/format.h>

#include <lua.hpp>

#include "bindings/host/construct.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/objects.h"
#include "bindings/host/script_place.h"
#include "bindings/host/script_type.h"
#include "runtime/at_node.h"
#include "runtime/graph/make_node.h"
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

// Kernels among the arguments are numbered in the order of the type's parameters, in every state alike. Takes them from
// the table at `index`; returns, in the main state, the kernels by parameter.
std::map<std::string, ObjectPtr> take_kernels(State& state, const NodeType& type, int index)
{
    std::map<std::string, ObjectPtr> kernels;
    lua_State* L = state.lua();
    ScriptHost& host = state.host();
    for (const Param& param : type.params) {
        const bool of_the_set = param.type == Kernel::set_function_type;
        // "function of a point", or that among others.
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
        source.location = place_of_function(L, -1);
        source.number = state.add_kernel();
        source.of_the_set = of_the_set;
        source.may_compute_groups = param.internal && names_groups(type);
        if (state.is_main()) {
            kernels[param.name] = host.kernels.emplace_back(std::make_shared<Kernel>(host, source));
        } else if (source.number >= host.kernels.size()) {
            throw Error("the graph file made more kernels in a worker than at first; it must do the same each time");
        }
        if (!param.internal) {
            lua_pushnil(L);
            lua_setfield(L, index, param.name.c_str());
        }
    }
    return kernels;
}

// The nodes in the graph that are numbered together, and so many more.
int count_nodes(lua_State* L, const std::string& stem, int more)
{
    constexpr char counts[] = "rapid.node_counts";  // in the registry, by stem
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

// Sets the arguments and, where they have one, the name.
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

// The inputs are on the stack behind the type and the arguments.
void take_inputs(State& state, Node& node)
{
    for (int i = 3; i <= lua_gettop(state.lua()); ++i) {
        const auto input = std::dynamic_pointer_cast<const NodeHandle>(to_object(state, i));
        if (!input)
            throw Error(fmt::format("input {} is {}; it must be a node: call it as node:{}{{ ... }}", i - 2,
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
        throw Error(fmt::format(":{} is called while a frame runs; the graph's body makes the nodes", type.name));

    copy_table(state.lua(), 2);
    const std::map<std::string, ObjectPtr> kernels = take_kernels(state, type, 2);
    return construct(state, [&]() -> ObjectPtr {
        auto node = make_node();
        node->type = &type;
        node->location = where(state);
        node->serial = host.graph.nodes.size();
        const std::string& stem = type.counted_as.empty() ? type.name : type.counted_as;
        node->name = fmt::format("{}{}", stem, count_nodes(state.lua(), stem, 0) + 1);
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

// A type that Lua defines must have been defined in this state, too, which has its kernel.
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

// The nearest name is looked for among the shipped types, too, which are loaded when they are first used.
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
