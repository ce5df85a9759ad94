#include "runtime/graph/arguments.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/graph/step_shape.h"
#include "runtime/points/attribute_like.h"

namespace rapid {
namespace {

bool varies(const Value& value)
{
    if (value.function()) return true;
    if (const ObjectPtr* object = value.get<ObjectPtr>()) return *object && (*object)->varies();
    const Table* table = value.table();
    if (!table) return false;
    const auto entry_varies = [](const auto& entry) { return varies(entry.second); };
    return std::any_of(table->list.begin(), table->list.end(), [](const Value& entry) { return varies(entry); }) ||
           std::any_of(table->numbered.begin(), table->numbered.end(), entry_varies) ||
           std::any_of(table->named.begin(), table->named.end(), entry_varies);
}

// Returns the message for an unknown parameter; for an attribute, it explains how newborn points get it.
std::string unknown(const NodeType& type, const std::string& name)
{
    const Param* values = type.find("attributes");
    const bool gives_attributes = values && values->type == param_type<std::map<std::string, AttributeValue>>();
    const std::string made = name == "name" ? "" : advice_for_making(name);
    const auto conventional_or_known = [](const std::string& attribute) {
        return known_attribute(attribute) || conventional_attribute(attribute);
    };
    if (gives_attributes && conventional_or_known(name))
        return fmt::format("unknown parameter \"{}\"; it is an attribute of points: attributes = {{ {} }}", name, made);
    const std::string known(name_of_synonym(name));
    if (!known.empty() && type.find(known))
        return fmt::format("unknown parameter \"{}\"; did you mean \"{}\"?", name, known);
    if (gives_attributes && conventional_or_known(known))
        return fmt::format("unknown parameter \"{}\"; the {} of points is {}: attributes = {{ {} }}", name, name, known,
                           advice_for_making(known));
    constexpr std::string_view amounts[] = {"amount", "births", "number", "particles", "quantity"};
    if (type.find("rate") && type.find("count") &&
        std::find(std::begin(amounts), std::end(amounts), name) != std::end(amounts))
        return fmt::format("unknown parameter \"{}\"; give rate (points per second) or count (points per frame)", name);
    const std::vector<std::string> names = type.param_names();
    if (const std::string near = did_you_mean(name, names); !near.empty())
        return fmt::format("unknown parameter \"{}\"{}", name, near);
    if (gives_attributes)
        return fmt::format(
            "unknown parameter \"{}\"; `rapid nodes {}` lists the parameters; an attribute of points goes into "
            "attributes = {{ {} }}",
            name, type.name, made);
    constexpr std::size_t most = 12;  // names in a message
    if (names.size() > most)
        return fmt::format("unknown parameter \"{}\"; `rapid nodes {}` lists the parameters", name, type.name);
    return fmt::format("unknown parameter \"{}\"; {} has {}", name, type.name, fmt::join(names, ", "));
}

// Calls a function of the frame; its Errors name the frame.
void assign_at(const Param& param, Operator& op, const FrameFunction& function, const FrameClock& clock,
               const Frame& frame)
{
    try {
        const Value result = function.call(frame);
        if (result.is_nil() && !param.may_be_nil) wrong_type(param, result);
        if (result.function())
            throw Error(fmt::format("{} is a function that returned a function; it must return a value", param.name));
        param.assign(param, op.fields(), in_step(param, result, clock, frame));
    } catch (const Error& error) {
        throw error.reworded(fmt::format("{} (frame {})", error.message(), frame.number));
    }
}

}  // namespace

void require_param(const NodeType& type, const std::string& name)
{
    const Param* param = type.find(name);
    if (param ? param->internal : !type.rest) throw Error(unknown(type, name));
}

void bind_arguments(const Node& node, Operator& op, const FrameClock& clock, const Frame& frame, bool only_changing)
{
    for (const auto& [name, value] : node.arguments) {
        const Param* param = node.type->find(name);
        Param any;
        if (!param) {
            if (!node.type->rest) throw Error(unknown(*node.type, name));
            any = *node.type->rest;
            any.name = name;
            param = &any;
        }
        if (const FrameFunction* function = value.function(); function && !param->keeps_function) {
            if (!param->of_the_frame)
                throw Error(fmt::format("{} can't be a function of the frame; it must be a constant", name));
            assign_at(*param, op, *function, clock, frame);
        } else if (!only_changing || differs_by_step(*param, value)) {
            param->assign(*param, op.fields(), in_step(*param, value, clock, frame));
        }
    }
    if (only_changing) return;
    for (const Param& param : node.type->params) {
        if (node.arguments.count(param.name)) continue;
        if (param.required)
            throw Error(
                fmt::format("{} is missing: {} (a name without a value counts as missing)", param.name, param.doc));
        if (!param.fallback.is_nil()) param.assign(param, op.fields(), param.fallback);
    }
}

double constant_argument(const Node& node, std::string_view param)
{
    const auto given = node.arguments.find(std::string(param));
    const Value& value = given == node.arguments.end() ? node.type->find(param)->fallback : given->second;
    const double* number = value.get<double>();
    return number ? *number : 0;
}

std::string varying_argument(const Node& node)
{
    const auto found = std::find_if(node.arguments.begin(), node.arguments.end(),
                                    [](const auto& argument) { return varies(argument.second); });
    return found == node.arguments.end() ? std::string() : found->first;
}

std::vector<std::string> functions_of_the_frame(const Node& node)
{
    std::vector<std::string> names;
    for (const auto& [name, value] : node.arguments) {
        const Param* param = node.type->find(name);
        if (param && value.function() && !param->keeps_function) names.push_back(name);
    }
    return names;
}

}  // namespace rapid
