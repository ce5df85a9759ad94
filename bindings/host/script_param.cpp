#include "bindings/host/script_param.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bindings/host/ramp.h"
#include "bindings/host/script_operator.h"
#include "runtime/graph/step_shape.h"
#include "runtime/points/attribute_like.h"
#include "runtime/points/point_names.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/vector_grid.h"

namespace rapid {
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

}  // namespace rapid
