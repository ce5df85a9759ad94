#include "bindings/host/script_type.h"

#include <fmt/format.h>

#include <algorithm>
#include <lua.hpp>

#include "bindings/host/lua_text.h"
#include "bindings/host/script_host.h"
#include "bindings/host/script_location.h"
#include "bindings/host/script_operator.h"
#include "bindings/host/script_param.h"
#include "bindings/host/values.h"
#include "runtime/graph/registry.h"

namespace rapid {
namespace {

constexpr char definitions[] = "rapid.definitions";  // registry key in each state: kernels by type name

// Functions of which a definition has exactly one.
constexpr std::string_view roles[] = {"points", "action", "detail", "expand"};

// Returns the role of the definition at `index`; empty if it has none, or several.
std::string_view role_of(lua_State* L, int index)
{
    std::string_view role;
    int functions = 0;
    for (const std::string_view name : roles) {
        lua_getfield(L, index, name.data());
        if (lua_isfunction(L, -1) && functions++ == 0) role = name;
        lua_pop(L, 1);
    }
    return functions == 1 ? role : std::string_view();
}

void check_type_fields(const Table& definition, const std::string& what)
{
    std::vector<std::string> known = {"name", "doc", "params", "makes"};
    known.insert(known.end(), std::begin(roles), std::end(roles));
    for (const auto& [field, value] : definition.named)
        if (std::find(known.begin(), known.end(), field) == known.end())
            throw Error(fmt::format("{}: unknown field \"{}\"{}", what, field, did_you_mean(field, known)));
}

Param group_param()
{
    Param group;
    group.name = "group";
    group.type = "string";
    group.doc = "limits the node to the points of this group";
    group.of_the_frame = false;
    group.assign = [](const Param& self, void* fields, const Value& value) {
        read_value(self, value, static_cast<ScriptFields*>(fields)->group);
    };
    return group;
}

Param kernel_param(std::string_view role)
{
    Param kernel;
    kernel.name = "kernel";
    kernel.type = role == "detail" ? Kernel::set_function_type : PointFunction::param_type;
    kernel.doc = "the node's function";
    kernel.internal = true;
    kernel.of_the_frame = false;
    kernel.assign = [](const Param& self, void* fields, const Value& value) {
        read_value(self, value, static_cast<ScriptFields*>(fields)->kernel);
    };
    return kernel;
}

std::vector<AttributeSpec> read_makes(const Value& makes, const std::string& what)
{
    Param param;
    param.name = "makes";
    std::map<std::string, AttributeValue> attributes;
    try {
        read_value(param, makes, attributes);
    } catch (const Error& error) {
        throw Error(fmt::format("{}: {}", what, error.message()), error.kind());
    }
    std::vector<AttributeSpec> specs;
    for (const auto& [name, value] : attributes) specs.push_back({name, value});
    return specs;
}

NodeType read_type(const Table& definition, std::string_view role)
{
    NodeType type;
    type.name = text_field(definition, "name", "rapid.node");
    if (type.name.empty()) throw Error("rapid.node: the name is missing");
    const std::string what = fmt::format("rapid.node \"{}\"", type.name);
    type.doc = text_field(definition, "doc", what);
    if (type.doc.empty()) throw Error(what + ": the documentation is missing; add doc = \"...\"");
    check_type_fields(definition, what);
    if (role.empty())
        throw Error(what +
                    ": the function is missing; add one of points = function(p, frame, params), action = function(p, "
                    "step, params), detail = function(points, frame, params) and expand = function(input, params)");
    type.varies = true;
    if (role == "action") type.kind = NodeKind::Dynamic;
    if (const Value* params = find_field(definition, "params")) {
        const Table* table = params->table();
        if (!table || !table->list.empty()) throw Error(what + ": params must be a table of declarations by name");
        for (const auto& [name, declared] : table->named) type.params.push_back(read_param(name, declared, type.name));
    }
    if (role == "points" || role == "action") type.params.push_back(group_param());
    if (role != "expand") type.params.push_back(kernel_param(role));
    if (const Value* makes = find_field(definition, "makes")) {
        if (role == "expand") throw Error(what + ": makes is only for points, action and detail");
        type.uses.makes = read_makes(*makes, what);
    }
    type.make = [edits = role == "points", kind = type.kind, made = type.uses.makes] {
        ScriptFields fields;
        fields.makes = made;
        return make_script_operator(kind, edits, std::move(fields));
    };
    return type;
}

}  // namespace

int define_node_type(State& state)
{
    lua_State* L = state.lua();
    ScriptHost& host = state.host();
    if (state.is_loaded()) throw Error("rapid.node is called while a frame runs; call it in the file of the node");

    const std::string_view role = role_of(L, 1);
    lua_getfield(L, 1, "name");
    const std::string name = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
    lua_pop(L, 1);
    if (state.is_main()) {
        const Value definition = to_value(state, 1);
        NodeType type = read_type(*definition.table(), role);
        type.defined_in = where(state).file;
        host.registry.add(std::move(type));
    }
    // A type without a kernel (expand) is marked as known.
    luaL_newmetatable(L, definitions);
    if (role.empty() || role == "expand")
        lua_pushboolean(L, 1);
    else
        lua_getfield(L, 1, role.data());
    lua_setfield(L, -2, name.c_str());
    return 0;
}

bool names_groups(const NodeType& type)
{
    return std::any_of(type.params.begin(), type.params.end(),
                       [](const Param& p) { return p.type == group_param_type; });
}

void push_kernel_of_type(State& state, const std::string& type)
{
    lua_State* L = state.lua();
    luaL_newmetatable(L, definitions);
    lua_getfield(L, -1, type.c_str());
    lua_remove(L, -2);
}

int complete_arguments(State& state)
{
    const NodeType& type = state.host().registry.at(text_at(state.lua(), 1));
    const Value given = to_value(state, 2);
    const Table* table = given.table();
    if (!table) throw Error(fmt::format(":{} needs a table of parameters", type.name));
    ScriptFields fields;
    try {
        assign_arguments(type.params, table->named, &fields);
    } catch (Error& error) {
        error.in_node(type.name);
        throw;
    }
    push(state, std::move(fields.arguments.values));
    return 1;
}

}  // namespace rapid
