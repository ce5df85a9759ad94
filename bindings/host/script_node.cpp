#include "bindings/host/script_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <lua.hpp>

#include "bindings/host/detail.h"
#include "bindings/host/ramp.h"
#include "bindings/host/script_host.h"
#include "runtime/graph/registry.h"
#include "runtime/shapes/shape.h"

namespace rapid {
namespace {

constexpr char definitions[] = "rapid.definitions";  // in each state's registry: kernels by type name

constexpr std::string_view reads_doc = "attributes that the kernel reads under names that it computes";
constexpr std::string_view writes_doc = "attributes that it assigns under names that it computes";

// What a kernel's node declares, since its bytecode does not tell it.
KernelArguments declared(const std::vector<std::string>& reads, const std::vector<std::string>& writes)
{
    KernelArguments arguments;
    arguments.reads.insert(reads.begin(), reads.end());
    arguments.writes.insert(writes.begin(), writes.end());
    return arguments;
}

void check_writable(const std::vector<std::string>& writes)
{
    for (const char* name : {"id", "dt", "index"})
        if (std::find(writes.begin(), writes.end(), name) != writes.end())
            throw Error(fmt::format("writes: {} is read only", name));
}

// points: an edit of the points, one by one, written in Lua.
struct Points {
    std::string group;
    std::shared_ptr<const Kernel> kernel;
    std::vector<std::string> reads, writes;

    static NodeType declare()
    {
        return node<Points>("points", "Edits the points with a Lua function, one by one, in parallel.")
            .param(&Points::kernel, "kernel", Value(), any_number(), "", "function(p, frame)")
            .of_type(std::string(PointFunction::param_type))
            .required()
            .constant()
            .varies()
            .param(&Points::reads, "reads", Value(), any_number(), "", std::string(reads_doc))
            .constant()
            .param(&Points::writes, "writes", Value(), any_number(), "", std::string(writes_doc))
            .constant();
    }
    static std::unique_ptr<Operator> make() { return std::make_unique<PointEditOf<Points>>(); }
    void check() const { check_writable(writes); }
    void uses(Uses& uses) const { kernel->uses(uses, declared(reads, writes)); }
    bool removes_points() const { return kernel->kills(); }
    bool asks_places() const { return kernel->asks_places(); }
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const
    {
        return kernel->prepare(points, group, now, declared(reads, writes), before);
    }
};
RAPID_NODE(Points);

// action: the same inside Solve, at every sub-step (paper §2.3).
struct ScriptAction {
    std::string group;
    std::shared_ptr<const Kernel> kernel;
    std::vector<std::string> reads, writes;

    static NodeType declare()
    {
        return node<ScriptAction>("action", "Edits the points with a Lua function inside Solve, at every sub-step.")
            .param(&ScriptAction::kernel, "kernel", Value(), any_number(), "", "function(p, step)")
            .of_type(std::string(PointFunction::param_type))
            .required()
            .constant()
            .varies()
            .param(&ScriptAction::reads, "reads", Value(), any_number(), "", std::string(reads_doc))
            .constant()
            .param(&ScriptAction::writes, "writes", Value(), any_number(), "", std::string(writes_doc))
            .constant();
    }
    void check() const { check_writable(writes); }
    void uses(Uses& uses) const { kernel->uses_in_action(uses, declared(reads, writes)); }
    std::shared_ptr<const Action> dynamic(const Evaluation& now) const
    {
        return kernel->action(group, now, declared(reads, writes));
    }
};
RAPID_NODE(ScriptAction);

// detail: a function over the whole set, once a frame.
struct Detail {
    std::shared_ptr<const Kernel> kernel;

    static NodeType declare()
    {
        return node<Detail>("detail", "Runs a Lua function over the whole set of points, once.")
            .param(&Detail::kernel, "kernel", Value(), any_number(), "", "function(points, frame)")
            .of_type(std::string(Kernel::set_function_type))
            .required()
            .constant()
            .varies();
    }
    void uses(Uses& uses) const { kernel->uses(uses); }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        run_detail(*kernel, inputs[0], now, {});
        return std::move(inputs[0]);
    }
};
RAPID_NODE(Detail);

// Of a node type that rapid.node defines: its parameters' values by name, its kernel, and the attributes that it makes.
struct ScriptFields {
    std::string group;
    std::shared_ptr<const Kernel> kernel;
    KernelArguments arguments;
    std::vector<AttributeSpec> makes;

    // Points that come from elsewhere, and those behind Solve, may not have them yet.
    void add_attributes(PointSet& points, const Evaluation& now) const
    {
        for (const AttributeSpec& spec : makes)
            if (now.keeps(spec.name)) points.add(spec);
    }

    // Where it edits the points, one by one.
    void uses(Uses& uses) const { kernel->uses(uses, arguments); }
    bool removes_points() const { return kernel->kills(); }
    bool asks_places() const { return kernel->asks_places(); }
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const
    {
        add_attributes(points, now);
        return kernel->prepare(points, group, now, arguments, before);
    }
};

// One that does something else.
class ScriptOperator : public Operator {
public:
    ScriptOperator(NodeKind kind, ScriptFields fields) : kind_(kind), fields_(std::move(fields)) {}

    void* fields() override { return &fields_; }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) override
    {
        fields_.add_attributes(inputs[0].points, now);
        if (fields_.kernel->of_the_set)
            run_detail(*fields_.kernel, inputs[0], now, fields_.arguments);
        else
            inputs[0].dynamics.add(fields_.kernel->action(fields_.group, now, fields_.arguments));
        return std::move(inputs[0]);
    }
    Flow start(std::span<Flow> inputs, const Evaluation&) override { return std::move(inputs[0]); }
    void uses(Uses& uses) const override
    {
        if (!fields_.group.empty()) uses.reads_groups.push_back(fields_.group);
        if (kind_ == NodeKind::Dynamic)
            fields_.kernel->uses_in_action(uses, fields_.arguments);
        else
            fields_.kernel->uses(uses, fields_.arguments);
    }
    void check() const override {}

private:
    const NodeKind kind_;
    ScriptFields fields_;
};

// The types that a parameter is declared with, and how each is checked and kept for the kernel.
constexpr std::string_view group_type = "name of a group", attribute_type = "name of an attribute";

KernelArguments& arguments_of(void* fields) { return static_cast<ScriptFields*>(fields)->arguments; }

// The functions that a definition may have; it has one of them.
constexpr std::string_view roles[] = {"points", "action", "detail", "expand"};

template <class T>
void keep_as(const Param& param, void* fields, const Value& value)
{
    T field{};
    read_value(param, value, field);
    Value kept = value;
    if constexpr (std::is_same_v<T, Vec3d>) kept = Value(field);
    arguments_of(fields).values[param.name] = std::move(kept);
}

void keep_ramp(const Param& param, void* fields, const Value& value)
{
    arguments_of(fields).values[param.name] = Value(ObjectPtr(read_ramp(param, value)));
}

template <class T>
void keep_list(const Param& param, void* fields, const Value& value)
{
    std::vector<T> list;
    read_value(param, value, list);
    Table kept;
    for (const T& element : list) kept.list.emplace_back(element);
    arguments_of(fields).values[param.name] = Value(std::make_shared<const Table>(std::move(kept)));
}

enum class Access { Reads, Writes, Joins };

template <Access access>
void keep_name(const Param& param, void* fields, const Value& value)
{
    keep_as<std::string>(param, fields, value);
    const std::string& name = *value.get<std::string>();
    if (name.empty()) throw Error(fmt::format("{} = \"\"; it must be the {}", param.name, param.type));
    KernelArguments& arguments = arguments_of(fields);
    if constexpr (access == Access::Joins) {
        arguments.joins.insert(name);
    } else {
        if (access == Access::Writes && (name == "id" || name == "dt"))
            throw Error(fmt::format("{} = \"{}\"; that attribute is read only", param.name, name));
        (access == Access::Writes ? arguments.writes : arguments.reads).insert(name);
    }
}

struct DeclaredType {
    std::string_view shown;
    decltype(Param::assign) assign;
    bool ranged = false;    // min and max mean something
    bool constant = false;  // takes no function of the frame
};

const std::map<std::string, DeclaredType>& declared_types()
{
    static const std::map<std::string, DeclaredType> types = {
        {"bool", {"boolean", keep_as<bool>}},
        {"float", {"number", keep_as<double>, true}},
        {"floats", {"list of numbers", keep_list<double>, true}},
        {"group", {group_type, keep_name<Access::Joins>, false, true}},
        {"int", {"integer", keep_as<int>, true}},
        {"ramp", {Ramp::param_type, keep_ramp, true}},
        {"read", {attribute_type, keep_name<Access::Reads>, false, true}},
        {"shape", {Shape::param_type, keep_as<ShapePtr>}},
        {"string", {"string", keep_as<std::string>}},
        {"vec3", {"vec3", keep_as<Vec3d>, true}},
        {"vec3s", {"list of vec3", keep_list<Vec3d>, true}},
        {"write", {attribute_type, keep_name<Access::Writes>, false, true}},
    };
    return types;
}

const Value* find(const Table& table, const char* name)
{
    const auto found = table.named.find(name);
    return found == table.named.end() || found->second.is_nil() ? nullptr : &found->second;
}

std::string text_of(const Table& table, const char* name, const std::string& what)
{
    const Value* value = find(table, name);
    if (!value) return {};
    const std::string* text = value->get<std::string>();
    if (!text) throw Error(fmt::format("{}: {} = {}; it must be a string", what, name, describe(*value)));
    return *text;
}

// params = { strength = { "float", default = 1, min = 0, unit = "1/s", doc = "..." } }
Param read_param(const std::string& name, const Value& declared, const std::string& node_name)
{
    const std::string what = fmt::format("rapid.node \"{}\", parameter {}", node_name, name);
    const Table* table = declared.table();
    const std::string* type = table && !table->list.empty() ? table->list.front().get<std::string>() : nullptr;
    if (!type) throw Error(what + ": declare it as { \"float\", default = 1, doc = \"...\" }");
    for (const auto& [field, value] : table->named)
        if (field != "default" && field != "min" && field != "max" && field != "unit" && field != "doc" &&
            field != "choices" && field != "required")
            throw Error(
                fmt::format("{}: unknown field \"{}\"{}", what, field,
                            did_you_mean(field, {"default", "min", "max", "unit", "doc", "choices", "required"})));

    Param param;
    param.name = name;
    param.unit = text_of(*table, "unit", what);
    param.doc = text_of(*table, "doc", what);
    if (param.doc.empty()) throw Error(what + ": say what it is, doc = \"...\"");
    if (const Value* lo = find(*table, "min")) {
        if (!lo->get<double>()) throw Error(fmt::format("{}: min = {}; it must be a number", what, describe(*lo)));
        param.range.lo = *lo->get<double>();
    }
    if (const Value* hi = find(*table, "max")) {
        if (!hi->get<double>()) throw Error(fmt::format("{}: max = {}; it must be a number", what, describe(*hi)));
        param.range.hi = *hi->get<double>();
        param.range.infinity = std::isinf(param.range.hi);  // max = math.huge takes it
    }
    if (const Value* required = find(*table, "required")) {
        const bool* flag = required->get<bool>();
        if (!flag) throw Error(fmt::format("{}: required = {}; it must be true or false", what, describe(*required)));
        param.required = *flag;
    }
    if (const Value* choices = find(*table, "choices")) read_value(param, *choices, param.choices);
    if (const Value* fallback = find(*table, "default")) param.fallback = *fallback;
    if (param.fallback.is_nil() && !param.required) throw Error(what + ": give it a default, or required = true");

    const auto known = declared_types().find(*type);
    if (known == declared_types().end()) {
        std::vector<std::string> names;
        for (const auto& [name_of_type, declared_type] : declared_types()) names.push_back(name_of_type);
        const std::string near = did_you_mean(*type, names);
        throw Error(fmt::format("{}: unknown type \"{}\"{}", what, *type,
                                near.empty() ? fmt::format("; there are {}", fmt::join(names, ", ")) : near));
    }
    if (param.range.bounded() && !known->second.ranged)
        throw Error(fmt::format("{}: min and max mean nothing for a {}", what, *type));
    param.type = known->second.shown;
    param.assign = known->second.assign;
    param.of_the_frame = !known->second.constant;
    ScriptFields scratch;  // a default is checked where it is declared
    try {
        if (!param.fallback.is_nil()) param.assign(param, &scratch, param.fallback);
    } catch (const Error& error) {
        throw Error(fmt::format("{}: the default {}", what, error.message()));
    }
    return param;
}

NodeType read_type(const Table& definition, std::string_view role)
{
    NodeType type;
    type.name = text_of(definition, "name", "rapid.node");
    if (type.name.empty()) throw Error("rapid.node: the name is missing");
    const std::string what = fmt::format("rapid.node \"{}\"", type.name);
    type.doc = text_of(definition, "doc", what);
    if (type.doc.empty()) throw Error(what + ": say what it does, doc = \"...\"");
    std::vector<std::string> known = {"name", "doc", "params", "makes"};
    known.insert(known.end(), std::begin(roles), std::end(roles));
    for (const auto& [field, value] : definition.named)
        if (std::find(known.begin(), known.end(), field) == known.end())
            throw Error(fmt::format("{}: unknown field \"{}\"{}", what, field, did_you_mean(field, known)));
    if (role.empty())
        throw Error(what +
                    ": give it one of points = function(p, frame, params), action = function(p, step, params), "
                    "detail = function(points, frame, params) and expand = function(input, params)");
    type.varies = true;
    if (role == "action") type.kind = NodeKind::Dynamic;
    if (const Value* params = find(definition, "params")) {
        const Table* table = params->table();
        if (!table || !table->list.empty()) throw Error(what + ": params is a table of declarations by name");
        for (const auto& [name, declared] : table->named) type.params.push_back(read_param(name, declared, type.name));
    }
    if (role == "points" || role == "action") {
        Param group;
        group.name = "group";
        group.type = "string";
        group.doc = "acts on this group only";
        group.of_the_frame = false;
        group.assign = [](const Param& self, void* fields, const Value& value) {
            read_value(self, value, static_cast<ScriptFields*>(fields)->group);
        };
        type.params.push_back(group);
    }
    if (role != "expand") {
        Param kernel;
        kernel.name = "kernel";
        kernel.type = role == "detail" ? Kernel::set_function_type : PointFunction::param_type;
        kernel.doc = "the node's function";
        kernel.internal = true;
        kernel.of_the_frame = false;
        kernel.assign = [](const Param& self, void* fields, const Value& value) {
            read_value(self, value, static_cast<ScriptFields*>(fields)->kernel);
        };
        type.params.push_back(kernel);
    }
    if (const Value* makes = find(definition, "makes")) {
        if (role == "expand") throw Error(what + ": makes belongs to points, action and detail");
        Param param;
        param.name = "makes";
        std::map<std::string, AttributeValue> attributes;
        try {
            read_value(param, *makes, attributes);
        } catch (const Error& error) {
            throw Error(fmt::format("{}: {}", what, error.message()));
        }
        for (const auto& [name, value] : attributes) type.uses.makes.push_back({name, value});
    }
    type.make = [edits = role == "points", kind = type.kind, made = type.uses.makes]() -> std::unique_ptr<Operator> {
        ScriptFields fields;
        fields.makes = made;
        if (edits) return std::make_unique<PointEditOf<ScriptFields>>(std::move(fields));
        return std::make_unique<ScriptOperator>(kind, std::move(fields));
    };
    return type;
}

}  // namespace

int define_node_type(State& state)
{
    lua_State* L = state.lua();
    ScriptHost& host = state.host();
    if (state.is_loaded()) throw Error("rapid.node is called while a frame runs; a node's file defines it");

    std::string_view role;  // empty where there is none, or several
    int functions = 0;
    for (const std::string_view name : roles) {
        lua_getfield(L, 1, name.data());
        if (lua_isfunction(L, -1) && functions++ == 0) role = name;
        lua_pop(L, 1);
    }
    if (functions > 1) role = {};

    lua_getfield(L, 1, "name");
    const std::string name = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
    lua_pop(L, 1);
    if (state.is_main()) {
        const Value definition = state.to_value(1);
        NodeType type = read_type(*definition.table(), role);
        type.defined_in = state.where().file;
        host.registry.add(std::move(type));
    }
    // The kernel; a type without one (expand) is known by a mark.
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
    return std::any_of(type.params.begin(), type.params.end(), [](const Param& p) { return p.type == group_type; });
}

void push_script_of(State& state, const std::string& type)
{
    lua_State* L = state.lua();
    luaL_newmetatable(L, definitions);
    lua_getfield(L, -1, type.c_str());
    lua_remove(L, -2);
}

int complete_arguments(State& state)
{
    const NodeType& type = state.host().registry.at(lua_tostring(state.lua(), 1));
    const Value given = state.to_value(2);
    const Table* table = given.table();
    if (!table) throw Error(fmt::format(":{} takes a table of parameters", type.name));
    ScriptFields fields;
    try {
        assign_arguments(type.params, table->named, &fields);
    } catch (Error& error) {
        error.in_node(type.name);
        throw;
    }
    Table complete;
    complete.named = std::move(fields.arguments.values);
    state.push(Value(std::make_shared<const Table>(std::move(complete))));
    return 1;
}

}  // namespace rapid
