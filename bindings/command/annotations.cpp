#include "bindings/command/annotations.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "bindings/command/param_facts.h"
#include "bindings/host/maker.h"

namespace rapid {
namespace {

// What no declaration tells: values, kernels and rapid.math, which are written in Lua (lua/vec3.lua, lua/numeric.lua).
constexpr std::string_view language = R"(---@meta rapid
-- The graph language, for editors with the Lua language server. Written by `rapid nodes --annotations`; do not edit.

---Three numbers that do not change.
---@class rapid.Vec3
---@field x number
---@field y number
---@field z number
---@operator add(rapid.Vec3): rapid.Vec3
---@operator sub(rapid.Vec3): rapid.Vec3
---@operator mul(number|rapid.Vec3): rapid.Vec3
---@operator div(number|rapid.Vec3): rapid.Vec3
---@operator unm: rapid.Vec3
local Vec3 = {}
---@param w rapid.Vec3
---@return number
function Vec3:dot(w) end
---@param w rapid.Vec3
---@return rapid.Vec3
function Vec3:cross(w) end
---@return number
function Vec3:length() end
---Of length 1; zero stays zero.
---@return rapid.Vec3
function Vec3:normalized() end
---This at t = 0, w at t = 1.
---@param w rapid.Vec3
---@param t number
---@return rapid.Vec3
function Vec3:lerp(w, t) end

---A rotation that does not change: q * r turns by r, and then by q.
---@class rapid.Quat
---@field x number
---@field y number
---@field z number
---@field w number
---@operator mul(rapid.Quat): rapid.Quat
local Quat = {}
---@param v rapid.Vec3
---@return rapid.Vec3
function Quat:rotate(v) end
---@return rapid.Quat
function Quat:inverse() end
---@return number
function Quat:length() end
---@return rapid.Quat
function Quat:normalized() end
---The shortest way from this (t = 0) to r (t = 1).
---@param r rapid.Quat
---@param t number
---@return rapid.Quat
function Quat:slerp(r, t) end

---@class rapid.StudyDefinition
---@field name string
---@field scene fun(knobs: table): rapid.Node|table<string, rapid.Node>
---@field frames integer[]  the first and the last
---@field sweep table<string, (number|string|boolean)[]>  the values of each knob
---@field lines? string|string[]  the knobs that tell the lines of the plot apart
---@field reference? table|fun(frame: rapid.Frame, knobs: table): table  knobs, or a closed form: { P = {...} }
---@field error? "rms"|"max"|"p95"|"residual"|fun(points: table, reference: table): number  of columns, place by place
---@field error_frames? "all"|"last"
---@field repeat_runs? integer  timed runs of each row, 5 if not given

---What `rapid study` runs; its file returns it.
---@param definition rapid.StudyDefinition
---@return table
function rapid.study(definition) end

---@overload fun(list: number[]): rapid.Vec3
---@param x number
---@param y number
---@param z number
---@return rapid.Vec3
function vec3(x, y, z) end

---@param x number
---@param y number
---@param z number
---@param w number
---@return rapid.Quat
function quat(x, y, z, w) end

---@alias rapid.Place rapid.Vec3|number[]

---@class rapid.Frame
---@field number number  counted from the scene's start
---@field time number    seconds since the start
---@field dt number      seconds to the next frame

---A point's own time, in an action.
---@class rapid.Step
---@field time number    seconds since the start
---@field dt number      seconds of this sub-step
---@field index integer  of the sub-step

---@class rapid.Attribute  each point's own value, from rapid.attr
---@class rapid.Points

---@class rapid.Motion  a * b moves by b, and then by a
---@operator mul(rapid.Motion): rapid.Motion

---@class rapid.Mesh
local Mesh = {}
---@param motion rapid.Motion
---@return rapid.Mesh
function Mesh:transform(motion) end

---@class rapid.Shape
local Shape = {}
---Metres, negative inside.
---@param P rapid.Vec3
---@return number
function Shape:distance(P) end
---Out of the shape.
---@param P rapid.Vec3
---@return rapid.Vec3
function Shape:gradient(P) end

---@class rapid.LevelSet: rapid.Shape
local LevelSet = {}
---Writes a .vdb file, in a run.
---@param path string  relative to the current folder
---@param options? { grid?: string }
---@return rapid.LevelSet
function LevelSet:write(path, options) end
---@param other rapid.LevelSet
---@return rapid.LevelSet
function LevelSet:union(other) end
---@param other rapid.LevelSet
---@return rapid.LevelSet
function LevelSet:intersect(other) end
---@param other rapid.LevelSet
---@return rapid.LevelSet
function LevelSet:subtract(other) end

---@class rapid.Grid  of vectors
local Grid = {}
---Between the voxels' values.
---@param P rapid.Vec3
---@return rapid.Vec3
function Grid:sample(P) end

---@class rapid
local rapid = {}
rapid.mesh, rapid.levelset, rapid.grid, rapid.shape, rapid.points, rapid.math = {}, {}, {}, {}, {}, {}

---@class rapid.options.grid_from
---@field at fun(P: rapid.Vec3): rapid.Vec3  asked at each node of the lattice, once
---@field size? rapid.Place    full edge lengths [m, default 1]
---@field center? rapid.Place  its middle [m, default 0]
---@field voxel? number        between nodes [m, default 0.1]

---A grid of vectors by a function of the place.
---@param options rapid.options.grid_from
---@return rapid.Grid
function rapid.grid.from(options) end

---A value that --set can replace.
---@generic T
---@param name string
---@param default T  a number, a boolean, a string or a vec3
---@param doc? string
---@return T
function rapid.param(name, default, doc) end

---Each point's own value of an attribute, for parameters that take it.
---@param name string
---@return rapid.Attribute
function rapid.attr(name) end

---@class rapid.NodeParameter
---@field [1] "bool"|"float"|"floats"|"group"|"int"|"ramp"|"read"|"shape"|"string"|"vec3"|"vec3s"|"write"
---@field default? any
---@field required? boolean
---@field min? number
---@field max? number
---@field unit? string
---@field choices? string[]
---@field doc string

---@class rapid.NodeDefinition
---@field name string  of its file, too
---@field doc string
---@field params? table<string, rapid.NodeParameter>
---@field makes? table<string, number|number[]>  attributes that it brings into being, with their value
---@field points? fun(p: rapid.Point, frame: rapid.Frame, params: table)
---@field action? fun(p: rapid.Point, step: rapid.Step, params: table)  inside Solve, at every sub-step
---@field expand? fun(input: rapid.Node, params: table): rapid.Node

---A node written in Lua; its file returns it.
---@param definition rapid.NodeDefinition
---@return rapid.NodeDefinition
function rapid.node(definition) end

---@param x number
---@param y number
---@param z number
---@return rapid.Motion
function rapid.translate(x, y, z) end

---@param columns table<string, any[]>  { P = {{x, y, z}, ...}, ANY = {...} }
---@return rapid.Points
function rapid.points.from(columns) end

---@param x number
---@param lo number
---@param hi number
---@return number
function rapid.math.clamp(x, lo, hi) end

---x carried from [lo, hi] to [from, to], and held at its ends.
---@param x number
---@param lo number
---@param hi number
---@param from number
---@param to number
---@return number
function rapid.math.fit(x, lo, hi, from, to) end

---0 up to lo, 1 from hi on, smooth between.
---@param lo number
---@param hi number
---@param x number
---@return number
function rapid.math.smoothstep(lo, hi, x) end

---A number in [-1, 1] that changes smoothly in place and time.
---@param P rapid.Vec3
---@param time? number
---@param octaves? integer
---@param seed? integer
---@return number
function rapid.math.noise(P, time, octaves, seed) end

---A flow, about 1 long, that neither gathers nor spreads points.
---@param P rapid.Vec3
---@param time? number
---@param octaves? integer
---@param seed? integer
---@return rapid.Vec3
function rapid.math.curl_noise(P, time, octaves, seed) end

---@param axis rapid.Vec3
---@param degrees number
---@return rapid.Quat
function rapid.math.rotation(axis, degrees) end

---@param from rapid.Vec3
---@param to rapid.Vec3
---@return rapid.Quat
function rapid.math.rotation_between(from, to) end
)";

// A type of an attribute, in Lua.
std::string_view lua_type(AttributeType type)
{
    switch (type) {
        case AttributeType::Float:
            return "number";
        case AttributeType::Vec3:
            return "rapid.Vec3";
        case AttributeType::Quat:
            return "rapid.Quat";
        default:
            return "integer";
    }
}

// A parameter's type; one that the list does not know is any.
std::string lua_type(const Param& param)
{
    static const std::map<std::string_view, std::string_view> known = {
        {"attribute value", "number|number[]|rapid.Vec3"},
        {"attributes", "table<string, number|number[]|rapid.Vec3>"},
        {"boolean", "boolean"},
        {"function of a point", "fun(p: rapid.Point, frame: rapid.Frame): any"},
        {"integer", "integer"},
        {"list", "any[]"},
        {"list of numbers", "number[]"},
        {"list of frames", "integer[]"},
        {"list of vec3", "rapid.Place[]"},
        {"level set", "rapid.Shape"},
        {"mesh", "rapid.Mesh"},
        {"mesh, level set, shape or points", "rapid.Mesh|rapid.Shape|rapid.Points"},
        {"motion", "rapid.Motion"},
        {"name of a group", "string"},
        {"name of an attribute", "string"},
        {"names", "string|string[]"},
        {"number", "number"},
        {"false or number", "number|boolean"},
        {"vec3, attribute or shape", "rapid.Place|rapid.Attribute|rapid.Shape"},
        {"vec3, attribute or moving shape", "rapid.Place|rapid.Attribute|rapid.Shape"},
        {"number or {min, max}", "number|number[]"},
        {"number, {min, max} or rapid.attr", "number|number[]|rapid.Attribute"},
        {"numbers by frame", "table<integer, number>"},
        {"points", "rapid.Points"},
        {"ramp", "any[]"},
        {"shape", "rapid.Shape"},
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

// :points and :action take a name and a kernel, too.
bool takes_kernel(const NodeType& type)
{
    const Param* kernel = type.find("kernel");
    return kernel && !kernel->internal;
}

// function(p, frame), as the documentation of the parameter says, or function(p, step).
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

std::string point_class()
{
    std::string text =
        "\n---The point that a kernel sees. Other attributes are those that the scene makes.\n"
        "---@class rapid.Point\n"
        "---@field P rapid.Vec3  m\n"
        "---@field v rapid.Vec3  m/s\n"
        "---@field id integer  read only\n"
        "---@field dt number  read only: seconds that this point is advanced in this frame\n"
        "---@field index integer  read only: place in the set, from 1\n";
    for (const AttributeSpec& spec : known_attributes())
        text += fmt::format("---@field {} {}\n", spec.name, lua_type(type_of(spec.fallback)));
    return text +
           "---@field [string] any\n"
           "local Point = {}\n"
           "---@param group string\n"
           "function Point:join(group) end\n"
           "---@param group string\n"
           "function Point:leave(group) end\n"
           "---@param group string\n"
           "---@return boolean\n"
           "function Point:within(group) end\n"
           "---Removes the point when its node ends.\n"
           "function Point:kill() end\n"
           "---In [0, 1): the point's own number k, the same in every frame, or with the frame anew in each.\n"
           "---@param k number\n"
           "---@param frame? rapid.Frame|number\n"
           "---@return number\n"
           "function Point:rand(k, frame) end\n";
}

std::string node_of(const NodeType& type)
{
    const bool source = type.kind == NodeKind::Source;
    std::string text =
        fmt::format("\n---@class rapid.params.{}\n{}", type.name, fields_of(type.params, true, kernel_of(type)));
    if (!type.find("name")) text += "---@field name? string  what the node is called in messages [string]\n";
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

// rapid.mesh.sphere { ... }, rapid.mesh.read(path), rapid.levelset.from_mesh(mesh, { ... }): what must be given comes
// first, as lua/rapid.lua has it.
std::string maker_of(const Maker& maker)
{
    static const std::map<std::string_view, std::string_view> results = {
        {"mesh", "rapid.Mesh"},   {"levelset", "rapid.LevelSet"}, {"grid", "rapid.Grid"},
        {"shape", "rapid.Shape"}, {"points", "rapid.Points"},     {"motion", "rapid.Motion"}};
    const std::size_t dot = maker.name.find('.');
    const std::string family = maker.name.substr(0, dot), own = maker.name.substr(dot + 1);
    const std::string called = family == "motion" ? own : maker.name;
    std::vector<Param> first, named;
    for (const Param& param : maker.params)
        (param.required && maker.name != "mesh.from" ? first : named).push_back(param);

    // levelset:offset(metres): a tool of the value that it takes first.
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

}  // namespace

std::string annotations_of(const Registry& registry)
{
    std::string text(language);
    for (const Maker* maker : all_makers()) {
        const bool told_above = maker->name == "motion.translate" || maker->name == "motion.product" ||
                                maker->name == "transform" || maker->name == "points.from" ||
                                maker->name == "grid.of_values" || maker->name == "levelset.write" ||
                                maker->name == "levelset.combine";
        if (!told_above) text += maker_of(*maker);
    }
    text += point_class();
    text += "\n---@class rapid.Node\nlocal Node = {}\n";
    for (const NodeType* type : registry.types()) text += node_of(*type);
    return text + "\nreturn rapid\n";
}

}  // namespace rapid
