#include "bindings/host/annotations.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "bindings/host/maker.h"
#include "bindings/host/modules.h"
#include "bindings/host/node_page.h"
#include "runtime/points/point_names.h"

namespace rapid {
namespace {

// Returns the Lua type of an attribute type.
std::string_view lua_type(AttributeType type)
{
    switch (type) {
        case AttributeType::Float:
            return "number";
        case AttributeType::Vec3:
            return "rapid.Vec3";
        case AttributeType::Quat:
            return "rapid.Quat";
        case AttributeType::String:
            return "string";
        default:
            return "integer";
    }
}

// Returns the Lua type of a parameter, or `any` if the list lacks it.
std::string lua_type(const Param& param)
{
    static const std::map<std::string_view, std::string_view> known = {
        {"attribute value", "number|number[]|rapid.Vec3|string"},
        {"attributes", "table<string, number|rapid.Vec3|string|any[]>"},
        {"boolean", "boolean"},
        {"event or function of a point", "string|fun(p: rapid.Point, frame: rapid.Frame): any"},
        {"function of a place", "fun(P: rapid.Vec3): rapid.Vec3"},
        {"function of a point", "fun(p: rapid.Point, frame: rapid.Frame): any"},
        {"integer", "integer"},
        {"moment or function of a point", "string|fun(p: rapid.Point, frame: rapid.Frame)"},
        {"list", "any[]"},
        {"list of numbers", "number[]"},
        {"list of frames", "integer[]"},
        {"list of vec3", "rapid.Place[]"},
        {"level set", "rapid.Shape"},
        {"mesh", "rapid.Mesh"},
        {"list of vec3, points, or curve", "rapid.Place[]|rapid.Points|rapid.Curve"},
        {"list of vec3, points, or function of the frame",
         "rapid.Place[]|rapid.Points|fun(frame: rapid.Frame): rapid.Place[]|rapid.Points"},
        {"mesh, level set, shape, fog, curve, points or vec3",
         "rapid.Mesh|rapid.Shape|rapid.Fog|rapid.Curve|rapid.Points|rapid.Place"},
        {"mesh, shape, points or rapid.attr", "rapid.Mesh|rapid.Shape|rapid.Points|rapid.Attribute"},
        {"motion", "rapid.Motion"},
        {"camera", "rapid.Camera|table<integer, rapid.Camera>"},
        {"name of a group", "string"},
        {"name of an attribute", "string"},
        {"name of a number attribute", "string"},
        {"names", "string|string[]"},
        {"node", "rapid.Node"},
        {"number", "number"},
        {"false or number", "number|boolean"},
        {"vec3, attribute or shape at rest or moving", "rapid.Place|rapid.Attribute|rapid.Shape"},
        {"vec3, attribute or moving shape", "rapid.Place|rapid.Attribute|rapid.Shape"},
        {"number or {min, max}", "number|number[]"},
        {"number or rapid.attr", "number|rapid.Attribute"},
        {"integer or rapid.attr", "integer|rapid.Attribute"},
        {"number, {min, max} or rapid.attr", "number|number[]|rapid.Attribute"},
        {"numbers by frame", "table<integer, number>"},
        {"points", "rapid.Points"},
        {"ramp", "any[]"},
        {"shape", "rapid.Shape"},
        {"shape at rest or moving", "rapid.Shape"},
        {"string", "string"},
        {"table", "table"},
        {"vector grid", "rapid.Grid"},
        {"vec3", "rapid.Place"},
    };
    std::string type;
    if (!param.choices.empty()) {
        for (const std::string& choice : param.choices)
            type += fmt::format("{}\"{}\"", type.empty() ? "" : "|", choice);
    } else {
        const auto found = known.find(param.type);
        type = found == known.end() ? "any" : found->second;
    }
    return type;
}

// Returns true for :points and :action, which also take a name and a kernel.
bool takes_kernel(const NodeType& type)
{
    const Param* kernel = type.find("kernel");
    return kernel && !kernel->internal;
}

// Returns the type of a kernel: fun(p, step) in an action, otherwise fun(p, frame).
std::string kernel_of(const NodeType& type)
{
    const bool action = type.kind == NodeKind::Dynamic;
    return fmt::format("fun(p: rapid.Point, {})", action ? "step: rapid.Step" : "frame: rapid.Frame");
}

std::string fields_of(const std::vector<Param>& params, bool functions, const std::string& kernel = "")
{
    std::string text;
    for (const Param& param : params) {
        if (param.internal) continue;
        std::string type = param.name == "kernel" ? kernel : lua_type(param);
        const bool is_function = type.find("fun(") != std::string::npos;
        if (param.per_point) type += "|rapid.Attribute";
        if (functions && param.of_the_frame && !is_function && type != "any")
            type += fmt::format("|fun(frame: rapid.Frame): {}", lua_type(param));
        text += fmt::format("---@field {}{} {}  {} {}\n", param.name, param.required ? "" : "?", type, param.doc,
                            facts_of(param));
    }
    return text;
}

// Returns the attributes that every scene has or that Rapid knows.
std::string point_fields()
{
    std::string text;
    for (const PointName& known : point_names) {
        if (known.role == PointName::Method) continue;
        text += fmt::format("---@field {} {}", known.name, lua_type(known.type));
        if (known.read_only) text += known.doc.empty() ? "  read only" : "  read only:";
        if (!known.doc.empty()) text += fmt::format("{}{}", known.read_only ? " " : "  ", known.doc);
        text += '\n';
    }
    for (const AttributeSpec& spec : known_attributes())
        text += fmt::format("---@field {} {}\n", spec.name, lua_type(type_of(spec.fallback)));
    return text;
}

std::string annotated(const NodeType& type)
{
    const bool source = type.kind == NodeKind::Source;
    std::string text =
        fmt::format("\n---@class rapid.params.{}\n{}", type.name, fields_of(type.params, true, kernel_of(type)));
    if (!type.find("name")) text += "---@field name? string  name of the node in messages [string]\n";
    if (type.rest) text += fmt::format("---@field [string] {}  {}\n", lua_type(*type.rest), type.rest->doc);
    text += fmt::format("\n---{}\n", type.doc);
    const bool required =
        std::any_of(type.params.begin(), type.params.end(), [](const Param& p) { return p.required; });
    if (takes_kernel(type))
        text +=
            fmt::format("---@overload fun(self: rapid.Node, name: string, kernel: {}): rapid.Node\n", kernel_of(type));
    if (type.kind == NodeKind::Merge)
        return text + fmt::format(
                          "---@param ... rapid.Node|rapid.params.{0}\n"
                          "---@return rapid.Node\nfunction Node:{0}(...) end\n",
                          type.name);
    return text + fmt::format("---@param params{} rapid.params.{}\n---@return rapid.Node\nfunction {}{}(params) end\n",
                              required ? "" : "?", type.name, source ? "rapid." : "Node:", type.name);
}

// Returns the declaration of a maker: rapid.mesh.sphere { ... }, rapid.mesh.read(path), rapid.levelset.from_mesh(mesh,
// { ... }). Required arguments come first, as in lua/rapid.lua.
std::string maker_of(const Maker& maker)
{
    static const std::map<std::string_view, std::string_view> results = {
        {"mesh", "rapid.Mesh"},     {"levelset", "rapid.LevelSet"}, {"grid", "rapid.Grid"},
        {"fog", "rapid.Fog"},       {"curve", "rapid.Curve"},       {"shape", "rapid.Shape"},
        {"points", "rapid.Points"}, {"motion", "rapid.Motion"},     {"camera", "rapid.Camera"}};
    const std::size_t dot = maker.name.find('.');
    const std::string family = maker.name.substr(0, dot), own = maker.name.substr(dot + 1);
    const std::string called = family == "motion" ? own : maker.name;
    std::vector<Param> first, named;
    for (const Param& param : maker.params) (param.required && own != "from" ? first : named).push_back(param);

    // levelset:offset(metres): a tool is a method of its first argument.
    const bool tool = !first.empty() && first.front().name == family;
    if (tool) first.erase(first.begin());

    std::string text, arguments;
    if (!named.empty())
        text += fmt::format("\n---@class rapid.options.{}_{}\n{}", family, own, fields_of(named, false));
    text += fmt::format("\n---{}\n", maker.doc);
    for (const Param& param : first) {
        text += fmt::format("---@param {} {}  {} {}\n", param.name, lua_type(param), param.doc, facts_of(param));
        arguments += (arguments.empty() ? "" : ", ") + param.name;
    }
    if (!named.empty()) {
        text += fmt::format("---@param options? rapid.options.{}_{}\n", family, own);
        arguments += arguments.empty() ? "options" : ", options";
    }
    return text + fmt::format("---@return {}\nfunction {}({}) end\n", results.at(family),
                              tool ? "LevelSet:" + own : "rapid." + called, arguments);
}

std::string makers_except(const std::set<std::string>& excepted)
{
    std::string text;
    for (const Maker* maker : all_makers())
        if (!excepted.count(maker->name)) text += maker_of(*maker);
    return text;
}

// Replaces the line `--@NAME WORD...` with the text that generate() makes from the set of its words.
template <class F>
void fill_in(std::string& text, const std::string& name, const F& generate)
{
    const std::size_t begin = text.find("--@" + name);
    RAPID_ASSERT(begin != std::string::npos);
    const std::size_t end = text.find('\n', begin) + 1;
    std::istringstream line(text.substr(begin, end - begin));
    const std::set<std::string> words{std::istream_iterator<std::string>(line), {}};
    text.replace(begin, end - begin, generate(words));
}

}  // namespace

std::string annotations_of(const Registry& registry)
{
    const std::filesystem::path path = lua_folder() / "annotations.lua";
    std::optional<std::string> text = read_lua_file(path);
    if (!text) throw Error("can't be read: Rapid's own Lua files are missing").at({path.string(), 0});
    text->erase(0, text->find("---@meta"));
    std::string nodes;
    for (const NodeType* type : registry.types()) nodes += annotated(*type);
    fill_in(*text, "makers", [](const std::set<std::string>& excepted) { return makers_except(excepted); });
    fill_in(*text, "point_fields", [](const auto&) { return point_fields(); });
    fill_in(*text, "nodes", [&](const auto&) { return nodes; });
    return *text;
}

}  // namespace rapid
