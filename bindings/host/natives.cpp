#include "bindings/host/natives.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <lua.hpp>

#include "bindings/host/detail.h"
#include "bindings/host/maker.h"
#include "bindings/host/script_host.h"
#include "bindings/host/script_node.h"
#include "runtime/graph/registry.h"
#include "runtime/noise.h"
#include "runtime/shapes/level_set/vector_grid.h"
#include "runtime/shapes/shape.h"

namespace rapid {
namespace {

// Called from compiled kernels. `anew`: 0, or the frame, for numbers that differ from frame to frame.
double draw(std::uint64_t random, std::int64_t id, double use, double anew)
{
    RandomKey key;
    key.value = random;
    if (anew != 0) {
        const auto mixed = uniform4(key, std::bit_cast<std::uint64_t>(anew), ~std::uint64_t{0});
        key.value ^=
            static_cast<std::uint64_t>(mixed[0] * 0x1p32) << 32 | static_cast<std::uint64_t>(mixed[1] * 0x1p32);
    }
    const auto numbers = uniform4(key, static_cast<std::uint64_t>(id), std::bit_cast<std::uint64_t>(use + 0.0));
    return numbers[0] + numbers[1] * 0x1p-32 < 1 ? numbers[0] + numbers[1] * 0x1p-32 : numbers[0];
}

NoiseOptions noise_options(double time, double octaves, double seed)
{
    return {time, static_cast<int>(octaves), static_cast<std::uint32_t>(seed)};
}

// As draw(); lua/numeric.lua has checked the numbers.
double noise_at(double x, double y, double z, double time, double octaves, double seed)
{
    return noise(Vec3d(x, y, z), noise_options(time, octaves, seed));
}
void curl_noise_at(double x, double y, double z, double time, double octaves, double seed, double* curl)
{
    Eigen::Map<Vec3d>(curl, 3) = curl_noise(Vec3d(x, y, z), noise_options(time, octaves, seed));
}

// Called from compiled kernels; lua/shape.lua keeps the shape.
double shape_distance(const void* shape, double x, double y, double z, double* gradient)
{
    const Vec3d P(x, y, z);
    double phi = 0;
    Vec3d slope;
    static_cast<const Shape*>(shape)->distance({&P, 1}, {&phi, 1}, {&slope, 1});
    Eigen::Map<Vec3d>(gradient, 3) = slope;
    return phi;
}

// Likewise.
void vector_grid_sample(const void* grid, double x, double y, double z, double* value)
{
    const Vec3d P(x, y, z);
    Vec3d found;
    static_cast<const VectorGrid*>(grid)->sample({&P, 1}, {&found, 1});
    Eigen::Map<Vec3d>(value, 3) = found;
}

std::string text_at(State& state, int index)
{
    std::size_t size = 0;
    const char* text = lua_tolstring(state.lua(), index, &size);
    return text ? std::string(text, size) : std::string();
}

// The table at `index`, which our Lua files have made or checked.
std::shared_ptr<const Table> table_at(State& state, int index)
{
    const Value value = state.to_value(index);
    const auto* table = value.get<std::shared_ptr<const Table>>();
    if (!table) throw Error(fmt::format("a table is expected, not {}", describe(value)));
    return *table;
}

// Error: a value without a name, as in :gravity { 0, -9.81, 0 }.
void check_named(const Table& options)
{
    const Value* value = !options.list.empty()       ? &options.list.front()
                         : !options.numbered.empty() ? &options.numbered.begin()->second
                                                     : nullptr;
    if (value) throw Error(fmt::format("{} has no name; write {{ NAME = value, ... }}", describe(*value)));
}

// A maker as graph code calls it: rapid.mesh.box, rapid.rotate, :transform, :offset.
std::string shown_name(const Maker& maker, const Table& options)
{
    const std::size_t dot = maker.name.find('.');
    if (dot == std::string::npos) return ":" + maker.name;
    // What a level set is asked to do is its method.
    if (maker.params.front().name == "levelset") {
        const auto how = options.named.find("how");
        return ":" + (how == options.named.end() ? maker.name.substr(dot + 1) : *how->second.get<std::string>());
    }
    return "rapid." + (maker.name.rfind("motion.", 0) == 0 ? maker.name.substr(dot + 1) : maker.name);
}

// What is made in a kernel would be made once a point, in states that do not tell each other. Error: one runs now.
void refuse_in_kernels(const State& state, const std::string& what, const std::string& remedy)
{
    if (state.runs_kernel()) throw Error(fmt::format("a kernel can't call {}; {}", what, remedy));
}

// native.outside_kernels(what, remedy)
int outside_kernels(State& state)
{
    refuse_in_kernels(state, text_at(state, 1), text_at(state, 2));
    return 0;
}

// What the main state's call of this constructor made; for the main state itself, what `make` makes.
template <class F>
int construct(State& state, const F& make)
{
    if (state.is_loaded()) {  // for a function of the frame: it is no worker's to ask for
        state.push_object(make());
        return 1;
    }
    ScriptHost& host = state.host();
    const std::size_t call = state.next_made++;
    if (state.is_main()) {
        host.made.emplace_back(ObjectPtr());
        try {
            ObjectPtr object = make();
            host.made[call] = object;
            state.push_object(object);
        } catch (const Error& error) {
            host.made[call] = std::string(error.what());
            throw;
        }
        return 1;
    }
    if (call >= host.made.size())
        throw Error("the graph file made more in a worker than at first; it must do the same each time it is run");
    if (const auto* failed = std::get_if<std::string>(&host.made[call])) throw Error(*failed);
    state.push_object(std::get<ObjectPtr>(host.made[call]));
    return 1;
}

int make_object(State& state)
{
    const Maker& maker = find_maker(text_at(state, 1));
    const auto options = table_at(state, 2);
    refuse_in_kernels(state, shown_name(maker, *options), "make it outside, once");
    return construct(state, [&] {
        ScriptHost& host = state.host();
        MakeContext context{host.folder(), host.warnings, host.options().may_write, host.options().on_read};
        try {
            check_named(*options);
            const auto make = [&] { return maker.make(maker, *options, context); };
            return host.made_before ? host.made_before->get(maker, options, make) : make();
        } catch (const Error& error) {
            throw Error(
                fmt::format("{}: {}", shown_name(maker, *options), error.what()));  // with the file that it names
        }
    });
}

int make_attribute(State& state)
{
    if (lua_type(state.lua(), 1) != LUA_TSTRING)
        throw Error("rapid.attr takes the name of an attribute: rapid.attr \"bounce\"");
    state.push_object(std::make_shared<AttributeName>(text_at(state, 1)));
    return 1;
}

// "5000" as a value of the same type as the default. Error: it is none.
Value parse_setting(const std::string& name, const std::string& text, const Value& fallback)
{
    const auto refuse = [&](const char* wanted) -> Value {
        throw Error(fmt::format("--set {}={}: the parameter is {}, as its default {} is", name, text, wanted,
                                describe(fallback)));
    };
    if (fallback.get<std::string>()) return Value(text);
    if (fallback.get<bool>()) {
        if (text == "true" || text == "1") return Value(true);
        if (text == "false" || text == "0") return Value(false);
        return refuse("true or false");
    }
    std::vector<double> numbers;
    std::string rest = text;
    std::erase_if(rest, [](char c) { return c == '{' || c == '}' || c == ' '; });
    for (std::size_t begin = 0; begin <= rest.size();) {
        const std::size_t end = std::min(rest.find(',', begin), rest.size());
        const std::string word = rest.substr(begin, end - begin);
        char* stop = nullptr;
        numbers.push_back(std::strtod(word.c_str(), &stop));
        if (word.empty() || *stop != '\0' || std::isnan(numbers.back()))
            return refuse(fallback.get<double>() ? "a number" : "a vec3 x,y,z");
        begin = end + 1;
    }
    if (fallback.get<double>()) return numbers.size() == 1 ? Value(numbers[0]) : refuse("a number");
    return numbers.size() == 3 ? Value(Vec3d(numbers[0], numbers[1], numbers[2])) : refuse("a vec3 x,y,z");
}

int declare_parameter(State& state)
{
    refuse_in_kernels(state, "rapid.param", "call it outside, once");
    lua_State* L = state.lua();
    ScriptHost& host = state.host();
    if (lua_type(L, 1) != LUA_TSTRING) throw Error("rapid.param takes a name, a default and a line of documentation");
    const std::string name = text_at(state, 1);
    const auto known = std::find_if(host.parameters.begin(), host.parameters.end(),
                                    [&](const Session::Parameter& p) { return p.name == name; });
    if (known != host.parameters.end() && !state.is_main()) {
        state.push(known->value);
        return 1;
    }
    Value fallback = state.to_value(2);
    if (const Table* table = fallback.table(); table && table->list.size() == 3) {
        Param param;
        param.name = name;
        param.type = "vec3";
        Vec3d vector;
        read_value(param, fallback, vector);
        fallback = Value(vector);
    }
    if (!fallback.get<double>() && !fallback.get<bool>() && !fallback.get<std::string>() && !fallback.get<Vec3d>())
        throw Error(
            fmt::format("rapid.param(\"{}\"): the default is {}; it must be a number, a boolean, a string or a vec3",
                        name, describe(fallback)));
    if (known != host.parameters.end()) {
        if (describe(known->fallback) != describe(fallback))
            throw Error(
                fmt::format("rapid.param(\"{}\"): its default was {} before and is {} here; give each parameter "
                            "one default, or another name",
                            name, describe(known->fallback), describe(fallback)));
        state.push(known->value);
        return 1;
    }
    const auto setting = host.options().set.find(name);
    const Value value = setting == host.options().set.end() ? fallback : parse_setting(name, setting->second, fallback);
    host.parameters.push_back({name, text_at(state, 3), value, fallback});
    state.push(value);
    return 1;
}

// Kernels among the arguments are numbered in the order of the type's parameters, in every state alike. Takes the table
// at `index`; gives, in the main state, the kernels by parameter.
std::map<std::string, ObjectPtr> take_kernels(State& state, const NodeType& type, int index)
{
    std::map<std::string, ObjectPtr> kernels;
    lua_State* L = state.lua();
    ScriptHost& host = state.host();
    for (const Param& param : type.params) {
        const bool of_the_set = param.type == Kernel::set_function_type;
        if (!of_the_set && param.type != PointFunction::param_type) continue;
        if (param.internal)
            push_script_of(state, type.name);
        else
            lua_getfield(L, index, param.name.c_str());
        if (!lua_isfunction(L, -1)) {
            lua_pop(L, 1);
            continue;
        }
        lua_Debug info;
        lua_pushvalue(L, -1);
        lua_getinfo(L, ">S", &info);
        const Location location{info.source[0] == '@' ? info.source + 1 : "", info.linedefined};
        const std::size_t number = state.add_kernel();
        if (state.is_main()) {
            host.kernels.push_back(std::make_shared<Kernel>(host, number, location, of_the_set));
            host.kernels.back()->may_compute_groups = param.internal && names_groups(type);
            kernels[param.name] = host.kernels.back();
        } else if (number >= host.kernels.size()) {
            throw Error("the graph file made more kernels in a worker than at first; it must do the same each time");
        }
        if (!param.internal) {
            lua_pushnil(L);
            lua_setfield(L, index, param.name.c_str());
        }
    }
    return kernels;
}

int make_node(State& state)
{
    lua_State* L = state.lua();
    ScriptHost& host = state.host();
    const NodeType& type = host.registry.at(text_at(state, 1));
    if (state.is_loaded())
        throw Error(fmt::format(":{} is called while a frame runs; the graph's body makes the nodes", type.name));

    // The caller's table is not changed.
    lua_newtable(L);
    lua_pushnil(L);
    while (lua_next(L, 2)) {
        lua_pushvalue(L, -2);
        lua_insert(L, -2);
        lua_rawset(L, -4);
    }
    lua_replace(L, 2);
    std::map<std::string, ObjectPtr> kernels = take_kernels(state, type, 2);

    return construct(state, [&]() -> ObjectPtr {
        auto node = std::make_shared<Node>();
        node->type = &type;
        node->location = state.where();
        node->serial = host.graph.nodes.size();
        const std::string what = type.name;
        const auto same = std::count_if(host.graph.nodes.begin(), host.graph.nodes.end(),
                                        [&](const NodePtr& other) { return other->type == &type; });
        node->name = fmt::format("{}{}", what, same + 1);
        try {
            const auto options = table_at(state, 2);
            check_named(*options);
            node->arguments = options->named;
            for (const Param& param : type.params)
                if (param.internal && node->arguments.count(param.name))
                    throw Error(fmt::format("unknown parameter \"{}\"{}", param.name,
                                            did_you_mean(param.name, type.param_names())));
            const auto named = node->arguments.find("name");
            if (named != node->arguments.end() && !type.find("name")) {
                const std::string* name = named->second.get<std::string>();
                if (!name || name->empty())
                    throw Error(fmt::format("name = {}; it must be a string", describe(named->second)));
                node->name = *name;
                node->arguments.erase(named);
            }
            for (auto& [param, kernel] : kernels) node->arguments[param] = Value(kernel);
            for (int i = 3; i <= lua_gettop(L); ++i) {
                const auto input = std::dynamic_pointer_cast<const NodeHandle>(state.to_object(i));
                if (!input)
                    throw Error(fmt::format("input {} is {}; it must be a node: call it as node:{}{{ ... }}", i - 2,
                                            describe(state.to_value(i)), what));
                node->inputs.push_back(input->node);
            }
        } catch (Error& error) {
            error.in_node(node->name).at(node->location);
            throw;
        }
        host.graph.nodes.push_back(node);
        return std::make_shared<NodeHandle>(node);
    });
}

// A type that Lua defines must have been defined in this state too: its kernel lives here.
int has_type(State& state)
{
    lua_State* L = state.lua();
    const NodeType* type = state.host().registry.find(text_at(state, 1));
    bool known = type != nullptr;
    if (known && !type->defined_in.empty()) {
        push_script_of(state, type->name);
        known = !lua_isnil(L, -1);
        lua_pop(L, 1);
    }
    lua_pushboolean(L, known);
    return 1;
}

// Error, always: what is near, among the shipped types too, which are loaded when they are first used.
int unknown_type(State& state)
{
    const Registry& registry = state.host().registry;
    const std::string name = text_at(state, 1);
    std::vector<std::string> names = ScriptHost::shipped_nodes();
    for (const NodeType* type : registry.types()) names.push_back(type->name);
    if (const std::string nearest = did_you_mean(name, names); !nearest.empty())
        throw Error(fmt::format("unknown node \"{}\"{}", name, nearest));
    registry.at(name);
    return 0;
}

// native.did_you_mean(name, names): `; did you mean "NEAREST"?`, or nothing.
int suggest(State& state)
{
    std::vector<std::string> names;
    read_value(Param(), Value(table_at(state, 2)), names);
    const std::string text = did_you_mean(text_at(state, 1), names);
    lua_pushlstring(state.lua(), text.data(), text.size());
    return 1;
}

int kind_of(State& state)
{
    const ObjectPtr object = state.to_object(1);
    const std::string_view kind = object ? object->kind() : "value";
    lua_pushlstring(state.lua(), kind.data(), kind.size());
    return 1;
}

// native.set_index(index, product): what reading a field of an object, and multiplying two, call.
int set_index(State& state)
{
    lua_State* L = state.lua();
    luaL_getmetatable(L, "rapid.object");
    lua_pushvalue(L, 1);
    lua_setfield(L, -2, "__index");
    lua_pushvalue(L, 2);
    lua_setfield(L, -2, "__mul");
    lua_pushcfunction(L, [](lua_State* state_of) {
        return guarded(state_of, [](State& s) {
            const ObjectPtr object = s.to_object(1);
            const std::string text = describe(Value(object));
            lua_pushlstring(s.lua(), text.data(), text.size());
            return 1;
        });
    });
    lua_setfield(L, -2, "__tostring");
    return 0;
}

// native.shape(object), native.vector_grid(object): its pointer, valid while the object is; nil for any other object.
template <class T>
int pointer_to(State& state)
{
    const auto object = std::dynamic_pointer_cast<const T>(state.to_object(1));
    if (object)
        lua_pushlightuserdata(state.lua(), const_cast<T*>(object.get()));
    else
        lua_pushnil(state.lua());
    return 1;
}

int trace_aborted(State& state)
{
    state.host().options().on_trace_abort(text_at(state, 1));
    return 0;
}

// native.read_module(name), native.read_node(name): text and chunk name, or nil and where it was looked for.
template <bool node>
int read_source(State& state)
{
    std::string looked_in;
    const auto source = state.host().find_module(text_at(state, 1), node, looked_in);
    lua_State* L = state.lua();
    if (!source) {
        lua_pushnil(L);
        lua_pushlstring(L, looked_in.data(), looked_in.size());
        return 2;
    }
    lua_pushlstring(L, source->text.data(), source->text.size());
    const std::string name = "@" + source->name;
    lua_pushlstring(L, name.data(), name.size());
    return 2;
}

template <int (*f)(State&)>
int native(lua_State* L)
{
    return guarded(L, f);
}

}  // namespace

void push_natives(State& state, const std::string& chunk_header)
{
    lua_State* L = state.lua();
    constexpr luaL_Reg functions[] = {{"make", native<make_object>},
                                      {"attribute", native<make_attribute>},
                                      {"param", native<declare_parameter>},
                                      {"node", native<make_node>},
                                      {"define", native<define_node_type>},
                                      {"complete", native<complete_arguments>},
                                      {"has_type", native<has_type>},
                                      {"unknown_type", native<unknown_type>},
                                      {"did_you_mean", native<suggest>},
                                      {"kind", native<kind_of>},
                                      {"set_index", native<set_index>},
                                      {"run", run_body},
                                      {"shape", native<pointer_to<Shape>>},
                                      {"vector_grid", native<pointer_to<VectorGrid>>},
                                      {"outside_kernels", native<outside_kernels>},
                                      {"trace_aborted", native<trace_aborted>},
                                      {"read_module", native<read_source<false>>},
                                      {"read_node", native<read_source<true>>}};
    lua_newtable(L);
    for (const luaL_Reg& function : functions) {
        lua_pushcfunction(L, function.func);
        lua_setfield(L, -2, function.name);
    }
    lua_pushboolean(L, !state.is_main() || state.host().options().quiet);
    lua_setfield(L, -2, "is_quiet");
    push_detail_natives(state);
    lua_setfield(L, -2, "detail");
    lua_pushlstring(L, chunk_header.data(), chunk_header.size());
    lua_setfield(L, -2, "chunk_header");
    const auto push_pointer = [L](const char* name, auto* function) {
        lua_pushlightuserdata(L, reinterpret_cast<void*>(function));
        lua_setfield(L, -2, name);
    };
    push_pointer("rand", &draw);
    push_pointer("noise", &noise_at);
    push_pointer("curl_noise", &curl_noise_at);
    push_pointer("shape_distance", &shape_distance);
    push_pointer("vector_grid_sample", &vector_grid_sample);
}

}  // namespace rapid
