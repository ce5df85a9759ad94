// rapid nodes: documents the node types, native and Lua-authored, from their declarations.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bindings/command/annotations.h"
#include "bindings/command/command.h"
#include "bindings/command/param_facts.h"
#include "bindings/host/own_nodes.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

// A default in JSON; a value that JSON has no form for is written as in messages.
ordered_json json_of(const Value& value)
{
    if (value.is_nil()) return nullptr;
    if (const bool* truth = value.get<bool>()) return *truth;
    if (const double* number = value.get<double>(); number && std::isfinite(*number)) return *number;
    if (const std::string* text = value.get<std::string>()) return *text;
    if (const Vec3d* v = value.get<Vec3d>()) return {v->x(), v->y(), v->z()};
    return describe(value);
}

ordered_json json_of(const Param& param)
{
    ordered_json json = {{"name", param.name}, {"type", param.type}, {"default", json_of(param.fallback)}};
    if (std::isfinite(param.range.lo)) json["min"] = param.range.lo;
    if (param.range.lo_excluded) json["above_min"] = true;
    if (std::isfinite(param.range.hi)) json["max"] = param.range.hi;
    if (!param.choices.empty()) json["choices"] = param.choices;
    json["unit"] = param.unit;
    json["doc"] = param.doc;
    json["required"] = param.required;
    json["per_point"] = param.per_point;
    json["of_the_frame"] = param.of_the_frame;
    return json;
}

ordered_json json_of(const NodeType& type)
{
    ordered_json params = ordered_json::array();
    for (const Param& param : type.params)
        if (!param.internal) params.push_back(json_of(param));
    ordered_json makes = ordered_json::array();
    for (const AttributeSpec& spec : type.uses.makes) makes.push_back(spec.name);
    return {{"name", type.name},
            {"doc", type.doc},
            {"params", params},
            {"other_params", type.rest ? ordered_json(type.rest->doc) : ordered_json(nullptr)},
            {"reads", type.uses.reads},
            {"writes", type.uses.writes},
            {"makes", makes}};
}

std::string list_of(const std::vector<const NodeType*>& types)
{
    std::size_t width = 0;
    for (const NodeType* type : types) width = std::max(width, type->name.size());
    std::string text;
    for (const NodeType* type : types) text += fmt::format("{:{}}  {}\n", type->name, width, type->doc);
    return text;
}

std::string page_of(const NodeType& type)
{
    const std::string call = type.kind == NodeKind::Source ? "rapid." + type.name : ":" + type.name;
    std::string text = fmt::format("{}{{...}}\n{}\n", call, type.doc);
    std::size_t width = std::string_view("name").size();
    for (const Param& param : type.params) width = std::max(width, param.name.size());
    text += '\n';
    for (const Param& param : type.params) {
        if (param.internal) continue;
        text += fmt::format("  {:{}}  {} {}\n", param.name, width, param.doc, facts_of(param));
    }
    if (!type.find("name"))
        text += fmt::format("  {:{}}  what the node is called in messages [string]\n", "name", width);
    if (type.rest) text += fmt::format("  {:{}}  {} [{}]\n", "...", width, type.rest->doc, type.rest->type);

    std::vector<std::string> made;
    for (const AttributeSpec& spec : type.uses.makes) made.push_back(spec.name);
    const auto names = [&](std::string_view what, const std::vector<std::string>& list) {
        if (!list.empty()) text += fmt::format("\n{} {}", what, fmt::join(list, ", "));
    };
    names("reads", type.uses.reads);
    names("writes", type.uses.writes);
    names("makes", made);
    if (text.back() != '\n') text += '\n';
    return text;
}

class Nodes : public Command {
public:
    std::string name() const override { return "nodes"; }
    std::string doc() const override { return "lists the nodes, or tells all about one"; }

    void declare(CLI::App& app) override
    {
        app.add_option("NAME", name_, "tells of this node alone")->type_name("");
        auto* json = app.add_flag("--json", json_, "as JSON");
        app.add_flag("--annotations", annotations_,
                     "as the Lua language server reads them: the text of lua/rapid.d.lua")
            ->excludes(json);
    }

    int run(const CommonOptions&) override
    {
        const NodeTypes types = with_own_nodes();
        for (const std::string& fault : types.faults) print_warning(fault);
        const Registry& registry = types.registry;
        if (annotations_) {
            if (!name_.empty()) throw Error("rapid nodes: --annotations is of all nodes; leave out " + name_);
            print(annotations_of(registry));
        } else if (!name_.empty()) {
            const NodeType& type = registry.at(name_);
            print(json_ ? json_of(type).dump(2, ' ', false, ordered_json::error_handler_t::replace) + '\n'
                        : page_of(type));
        } else if (json_) {
            ordered_json all = ordered_json::array();
            for (const NodeType* type : registry.types()) all.push_back(json_of(*type));
            print(all.dump(2, ' ', false, ordered_json::error_handler_t::replace) + '\n');
        } else {
            print(list_of(registry.types()));
        }
        return status_done;
    }

private:
    std::string name_;
    bool json_ = false, annotations_ = false;
};
RAPID_COMMAND(Nodes);

}  // namespace
}  // namespace rapid
