#include "bindings/host/script_type.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <lua.hpp>
#include <memory>
#include <string>
#include <vector>

#include "bindings/host/detail.h"
#include "bindings/host/kernel.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/script_error.h"
#include "bindings/host/script_host.h"
#include "bindings/host/values.h"
#include "runtime/graph/param.h"
#include "runtime/graph/registry.h"
#include "runtime/graph/step_shape.h"
#include "runtime/points/attribute_like.h"
#include "runtime/points/point_names.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/vector_grid.h"

namespace rapid {

// The parameters' values by name, the kernel, and the attributes that the node adds.
struct ScriptFields {
    std::string group;
    std::shared_ptr<const Kernel> kernel;
    KernelArguments arguments;
    std::vector<AttributeSpec> makes;

    // Adds the attributes to points that may lack them: those of another simulation, and those after Solve.
    void add_attributes(PointSet& points, const Evaluation& now) const
    {
        for (const AttributeSpec& spec : makes)
            if (now.keeps(spec.name)) points.add(spec);
    }

    // Adds the uses of an edit of the points, one by one.
    void uses(Uses& uses) const { kernel->uses(uses, arguments); }
    bool removes_points() const { return kernel->kills(); }
    bool reads_indices() const { return kernel->reads_indices(); }
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const
    {
        add_attributes(points, now);
        return kernel->prepare(points, group, now, arguments, before);
    }
};

// Makes the operator of a kernel that edits the points one by one, of an action, or of a function of all points.
std::unique_ptr<Operator> make_script_operator(NodeKind kind, bool edits_points, ScriptFields fields);

// Type of a parameter that names a group which its kernel changes.
inline constexpr std::string_view group_param_type = "name of a group";

// Returns a field of a definition, or null if it is not given.
const Value* find_field(const Table& table, const char* name);

// Returns a string of a definition, empty if it is not given. what: the definition, for the error.
std::string text_field(const Table& table, const char* name, const std::string& what);

namespace {

// An operator for an action or a function of all points.
class ScriptOperator : public Operator {
public:
    ScriptOperator(NodeKind kind, ScriptFields fields) : kind_(kind), fields_(std::move(fields)) {}

    void* fields() override { return &fields_; }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) override
    {
        fields_.add_attributes(inputs[0].points, now);
        if (fields_.kernel->source.of_the_set)
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

}  // namespace

std::unique_ptr<Operator> make_script_operator(NodeKind kind, bool edits_points, ScriptFields fields)
{
    if (edits_points) return std::make_unique<PointEditOf<ScriptFields>>(std::move(fields));
    return std::make_unique<ScriptOperator>(kind, std::move(fields));
}

namespace {

constexpr std::string_view attribute_type = "name of an attribute";

KernelArguments& arguments_of(void* fields) { return static_cast<ScriptFields*>(fields)->arguments; }

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
        if (access == Access::Writes && is_read_only(name))
            throw Error(fmt::format("{} = \"{}\": this attribute is read-only", param.name, name));
        if (access == Access::Reads && name == "nage")
            arguments.reads.insert({"age", "life"});  // the kernel's nage is computed from these
        else
            (access == Access::Writes ? arguments.writes : arguments.reads).insert(name);
    }
}

struct DeclaredType {
    std::string_view shown;
    decltype(Param::assign) assign;
    bool ranged = false;    // min and max are meaningful
    bool constant = false;  // does not take a function of the frame
};

// Maps each declared type to the check and the storage of its values.
const std::map<std::string, DeclaredType>& declared_types()
{
    static const std::map<std::string, DeclaredType> types = {
        {"bool", {"boolean", keep_as<bool>}},
        {"float", {"number", keep_as<double>, true}},
        {"floats", {"list of numbers", keep_list<double>, true}},
        {"fog", {DensityGrid::param_type, keep_as<DensityGridPtr>}},
        {"grid", {VectorGrid::param_type, keep_as<VectorGridPtr>}},
        {"group", {group_param_type, keep_name<Access::Joins>, false, true}},
        {"int", {"integer", keep_as<int>, true}},
        {"ramp", {Ramp::param_type, keep_ramp, true}},
        {"read", {attribute_type, keep_name<Access::Reads>, false, true}},
        {"shape", {StepShape::param_type, keep_as<ShapePtr>}},
        {"string", {"string", keep_as<std::string>}},
        {"vec3", {"vec3", keep_as<Vec3d>, true}},
        {"vec3s", {"list of vec3", keep_list<Vec3d>, true}},
        {"write", {attribute_type, keep_name<Access::Writes>, false, true}},
        {"write_number", {number_attribute_type, keep_name<Access::Writes>, false, true}},
    };
    return types;
}

// The functions below read parts of a declaration; what: the parameter, for errors.

void check_param_fields(const Table& table, const std::string& what)
{
    const std::vector<std::string> known = {"default", "min", "max", "unit", "doc", "choices", "required"};
    for (const auto& [field, value] : table.named)
        if (std::find(known.begin(), known.end(), field) == known.end())
            throw Error(fmt::format("{}: unknown field \"{}\"{}", what, field, did_you_mean(field, known)));
}

void read_limit(const Table& table, const char* name, const std::string& what, double& limit)
{
    const Value* value = find_field(table, name);
    if (!value) return;
    const double* number = value->get<double>();
    if (!number) throw Error(fmt::format("{}: {} = {}; it must be a number", what, name, describe(*value)));
    limit = *number;
}

void read_required(const Table& table, const std::string& what, bool& required)
{
    const Value* value = find_field(table, "required");
    if (!value) return;
    const bool* flag = value->get<bool>();
    if (!flag) throw Error(fmt::format("{}: required = {}; it must be true or false", what, describe(*value)));
    required = *flag;
}

const DeclaredType& find_type(const std::string& type, const std::string& what)
{
    const auto known = declared_types().find(type);
    if (known != declared_types().end()) return known->second;
    std::vector<std::string> names;
    for (const auto& [name, declared] : declared_types()) names.push_back(name);
    const std::string near = did_you_mean(type, names);
    throw Error(fmt::format("{}: unknown type \"{}\"{}", what, type,
                            near.empty() ? fmt::format("; it must be one of {}", fmt::join(names, ", ")) : near));
}

// Checks a default at its declaration.
void check_default(const Param& param, const std::string& what)
{
    ScriptFields scratch;
    try {
        if (!param.fallback.is_nil()) param.assign(param, &scratch, param.fallback);
    } catch (const Error& error) {
        throw Error(fmt::format("{}: the default {}", what, error.message()), error.kind());
    }
}

}  // namespace

// Reads a declaration such as { "float", default = 1, min = 0, unit = "1/s", doc = "..." }; its values are assigned to
// ScriptFields. Throws Error if the declaration or its default is wrong.
Param read_param(const std::string& name, const Value& declared, const std::string& node_name)
{
    const std::string what = fmt::format("rapid.node \"{}\", parameter {}", node_name, name);
    const Table* table = declared.table();
    const std::string* type = table && !table->list.empty() ? table->list.front().get<std::string>() : nullptr;
    if (!type) throw Error(what + ": the declaration must look like { \"float\", default = 1, doc = \"...\" }");
    check_param_fields(*table, what);

    Param param;
    param.name = name;
    param.unit = text_field(*table, "unit", what);
    param.doc = text_field(*table, "doc", what);
    if (param.doc.empty()) throw Error(what + ": the documentation is missing; add doc = \"...\"");
    read_limit(*table, "min", what, param.range.lo);
    read_limit(*table, "max", what, param.range.hi);
    param.range.infinity = find_field(*table, "max") && std::isinf(param.range.hi);  // max = math.huge allows it
    read_required(*table, what, param.required);
    if (const Value* choices = find_field(*table, "choices")) read_value(param, *choices, param.choices);
    if (const Value* fallback = find_field(*table, "default")) param.fallback = *fallback;
    if (param.fallback.is_nil() && !param.required)
        throw Error(what + ": the default is missing; add default = ..., or required = true");

    const DeclaredType& known = find_type(*type, what);
    if (param.range.bounded() && !known.ranged)
        throw Error(fmt::format("{}: a {} has no min and max; remove them", what, *type));
    param.type = known.shown;
    param.assign = known.assign;
    param.of_the_frame = !known.constant;
    check_default(param, what);
    return param;
}

const Value* find_field(const Table& table, const char* name)
{
    const auto found = table.named.find(name);
    return found == table.named.end() || found->second.is_nil() ? nullptr : &found->second;
}

std::string text_field(const Table& table, const char* name, const std::string& what)
{
    const Value* value = find_field(table, name);
    if (!value) return {};
    const std::string* text = value->get<std::string>();
    if (!text) throw Error(fmt::format("{}: {} = {}; it must be a string", what, name, describe(*value)));
    return *text;
}

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
