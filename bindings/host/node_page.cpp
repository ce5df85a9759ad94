#include "bindings/host/node_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <lua.hpp>
#include <set>

#include "bindings/host/lua_text.h"
#include "bindings/host/modules.h"
#include "bindings/host/script_host.h"
#include "runtime/base/json.h"

namespace rapid {
namespace {

// Adds a default to the JSON. A value without a JSON form is written as in messages.
void add_value(JsonText& json, const Value& value)
{
    if (value.is_nil()) return json.value(nullptr);
    if (const bool* truth = value.get<bool>()) return json.value(*truth);
    if (const double* number = value.get<double>(); number && std::isfinite(*number)) return json.value(*number);
    if (const std::string* text = value.get<std::string>()) return json.value(*text);
    if (const Vec3d* v = value.get<Vec3d>()) return json.value(*v);
    json.value(describe(value));
}

void add_param(JsonText& json, const Param& param)
{
    json.begin_object();
    json.members("name", param.name, "type", param.type, "default", [&] { add_value(json, param.fallback); });
    if (std::isfinite(param.range.lo)) json.member("min", param.range.lo);
    if (param.range.lo_excluded) json.member("above_min", true);
    if (std::isfinite(param.range.hi)) json.member("max", param.range.hi);
    if (!param.choices.empty()) json.member("choices", param.choices);
    json.members("unit", param.unit, "doc", param.doc, "required", param.required, "per_point", param.per_point,
                 "of_the_frame", param.of_the_frame);
    json.end();
}

std::vector<std::string> made_by(const NodeType& type)
{
    std::vector<std::string> names;
    for (const AttributeSpec& spec : type.uses.makes) names.push_back(spec.name);
    return names;
}

// Shows that a value may be a function of the frame, for the first number or vector that may; empty if none may.
std::string function_example(const NodeType& type)
{
    const auto found = std::find_if(type.params.begin(), type.params.end(), [](const Param& param) {
        return param.of_the_frame && !param.internal && (param.type == "vec3" || param.type == "number");
    });
    if (found == type.params.end()) return "";
    return fmt::format("\nA value may be a function of the frame: {} = function(frame) return {} end\n", found->name,
                       found->type == "vec3" ? "{math.sin(frame.time), 0, 0}" : "2 * frame.time");
}

}  // namespace

std::string json_of(const NodeType& type)
{
    JsonText json;
    json.begin_object();
    json.members("name", type.name, "doc", type.doc);
    json.key("params");
    json.begin_list();
    for (const Param& param : type.params)
        if (!param.internal) add_param(json, param);
    json.end();
    json.key("other_params");
    type.rest ? json.value(type.rest->doc) : json.value(nullptr);
    json.members("reads", type.uses.reads, "writes", type.uses.writes, "makes", made_by(type));
    json.end();
    return json.text();
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
    if (!type.find("name")) text += fmt::format("  {:{}}  name of the node in messages [string]\n", "name", width);
    if (type.rest) text += fmt::format("  {:{}}  {} [{}]\n", "...", width, type.rest->doc, type.rest->type);
    text += function_example(type);

    const auto names = [&](std::string_view what, const std::vector<std::string>& list) {
        if (!list.empty()) text += fmt::format("\n{} {}", what, fmt::join(list, ", "));
    };
    names("reads", type.uses.reads);
    names("writes", type.uses.writes);
    names("makes", made_by(type));
    if (text.back() != '\n') text += '\n';
    return text;
}

std::string facts_of(const Param& param)
{
    std::vector<std::string> facts = {param.type};
    if (!param.unit.empty()) facts.push_back(param.unit);
    if (param.range.bounded()) facts.push_back(param.range.text());
    if (!param.choices.empty()) facts.push_back(fmt::format("one of {}", fmt::join(param.choices, ", ")));
    if (param.required)
        facts.push_back("required");
    else if (!param.fallback.is_nil())
        facts.push_back("default " + describe(param.fallback));
    if (param.per_point) facts.push_back("takes rapid.attr");
    if (!param.of_the_frame && param.type.find("function") == std::string::npos) facts.push_back("constant");
    return fmt::format("[{}]", fmt::join(facts, ", "));
}

namespace {

// Returns true if a file defines a node: scenes and modules may lie next to it.
bool defines_node(const std::filesystem::path& file)
{
    std::error_code none;
    if (file.extension() != ".lua" || !std::filesystem::is_regular_file(file, none)) return false;
    const std::optional<std::string> text = read_lua_file(file);
    return text && text->find("rapid.node") != std::string::npos;
}

std::set<std::string> own_nodes()
{
    std::vector<std::filesystem::path> folders = rapid_path();
    folders.insert(folders.begin(), ".");
    std::set<std::string> names;
    for (const std::filesystem::path& folder : folders) {
        std::error_code unreadable;
        for (const auto& entry : std::filesystem::directory_iterator(folder, unreadable))
            if (defines_node(entry.path())) names.insert(entry.path().stem().string());
    }
    return names;
}

}  // namespace

NodeTypes with_own_nodes()
{
    ScriptHost host({}, SessionOptions{});
    host.load_shipped_nodes();
    NodeTypes types;
    for (const std::string& name : own_nodes()) {
        host.main().push_entry("load_node");
        push_text(host.main().lua(), name);
        try {
            host.main().call(1, 0);
        } catch (const Error& error) {
            types.faults.push_back(error.what());
        }
    }
    types.registry = host.registry;
    return types;
}

}  // namespace rapid
