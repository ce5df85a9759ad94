#include "bindings/host/natives.h"

#include <fmt/format.h>

#include <cstdio>
#include <lua.hpp>

#include "bindings/host/construct.h"
#include "bindings/host/detail_natives.h"
#include "bindings/host/graph_node.h"
#include "bindings/host/graph_parameter.h"
#include "bindings/host/kernel_functions.h"
#include "bindings/host/kernel_pass.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/maker.h"
#include "bindings/host/script_error.h"
#include "bindings/host/script_location.h"
#include "bindings/host/script_type.h"
#include "runtime/base/memory_budget.h"
#include "runtime/base/printable.h"
#include "runtime/base/setting_names.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/points/point_names.h"
#include "runtime/points/token.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/vector_grid.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/motion/animated.h"
#include "runtime/shapes/shape.h"

namespace rapid {
namespace {

// native.outside_kernels(action, remedy): raises an error while a kernel runs.
int outside_kernels(State& state)
{
    refuse_in_kernels(state, text_at(state.lua(), 1), text_at(state.lua(), 2));
    return 0;
}

// native.print(text): prints to the program that opened the scene, or to standard output in a form safe for terminals.
int print_text(State& state)
{
    if (const auto& callback = state.host().options().on_print) return callback(text_at(state.lua(), 1)), 0;
    const std::string text = printable(text_at(state.lua(), 1));
    std::fwrite(text.data(), 1, text.size(), stdout);
    return 0;
}

// native.did_you_mean(name, names): returns `; did you mean "NEAREST"?`, or nothing.
int suggest(State& state)
{
    std::vector<std::string> names;
    read_value(Param(), Value(table_at(state, 2)), names);
    push_text(state.lua(), did_you_mean(text_at(state.lua(), 1), names));
    return 1;
}

// native.names_frames(path): returns true if the path names a sequence of files.
int names_frames(State& state)
{
    lua_pushboolean(state.lua(), FramePattern::of_files(state.host().folder() / text_at(state.lua(), 1)).has_frame());
    return 1;
}

// native.require_memory(what, bytes, remedy): raises an error if that much memory is not free, or exceeds the scripts'
// limit.
int require_memory(State& state)
{
    const double bytes = lua_tonumber(state.lua(), 2);
    const std::string what = text_at(state.lua(), 1), remedy = text_at(state.lua(), 3);
    if (const auto most = static_cast<double>(state.host().options().script_memory); bytes > most)
        throw Error(fmt::format("{} would need about {:.0f} MiB of Lua's memory, which has {:.0f}; {}, or set {}", what,
                                bytes / 0x1p20, most / 0x1p20, remedy, name_of(Setting::ScriptMemory)),
                    ErrorKind::OutOfMemory);
    if (!fits_in_memory(bytes)) throw memory_exceeded(what, bytes, remedy);
    return 0;
}

int kind_of(State& state)
{
    const ObjectPtr object = to_object(state, 1);
    push_text(state.lua(), object ? object->kind() : "value");
    return 1;
}

// native.shape(object): returns its pointer, valid while the object is. For a moving shape or a mesh it returns nil and
// true; while a kernel runs, the pointer of the step and true. Returns nil for any other object.
int pointer_to_shape(State& state)
{
    lua_State* L = state.lua();
    const ObjectPtr object = to_object(state, 1);
    if (const auto* shape = dynamic_cast<const Shape*>(object.get())) {
        lua_pushlightuserdata(L, const_cast<Shape*>(shape));
        return 1;
    }
    const bool moves = object && (is_moving_shape(*object) || dynamic_cast<const Mesh*>(object.get()));
    const Shape* now = moves ? KernelPass::shape_now(object.get()) : nullptr;
    if (now)
        lua_pushlightuserdata(L, const_cast<Shape*>(now));
    else
        lua_pushnil(L);
    lua_pushboolean(L, moves);
    return 2;
}

// native.mesh(object): returns the pointer to a mesh, or to the mesh at rest if it moves; nil for any other object.
int pointer_to_mesh(State& state)
{
    const ObjectPtr object = to_object(state, 1);
    const auto* moving = dynamic_cast<const AnimatedMesh*>(object.get());
    const auto* mesh = moving ? moving->rest().get() : dynamic_cast<const Mesh*>(object.get());
    if (mesh)
        lua_pushlightuserdata(state.lua(), const_cast<Mesh*>(mesh));
    else
        lua_pushnil(state.lua());
    return 1;
}

// native.vector_grid(object), .fog(object): return its pointer, valid while the object is; nil for any other object.
template <class T>
int pointer_to(State& state)
{
    const auto object = std::dynamic_pointer_cast<const T>(to_object(state, 1));
    if (object)
        lua_pushlightuserdata(state.lua(), const_cast<T*>(object.get()));
    else
        lua_pushnil(state.lua());
    return 1;
}

// native.text(number), native.number(text): convert strings of attributes (runtime/points/token.h).
int text_of_number(State& state)
{
    push_text(state.lua(), token_of_number(static_cast<std::uint32_t>(lua_tonumber(state.lua(), 1))).text());
    return 1;
}
int number_of_text(State& state)
{
    lua_pushnumber(state.lua(), token_of(text_at(state.lua(), 1)).number);
    return 1;
}

int trace_aborted(State& state)
{
    state.host().options().on_trace_abort(text_at(state.lua(), 1));
    return 0;
}

// native.add_code(file, list): adds the functions of a file, as lua/bytecode.lua lists them: line and text alternate.
int add_code(State& state)
{
    lua_State* L = state.lua();
    std::vector<Session::FunctionCode>& functions = state.host().code[text_at(L, 1)];
    functions.clear();
    const int size = static_cast<int>(lua_objlen(L, 2));
    for (int k = 1; k < size; k += 2) {
        lua_rawgeti(L, 2, k);
        lua_rawgeti(L, 2, k + 1);
        functions.push_back({static_cast<int>(lua_tointeger(L, -2)), content_hash(text_at(L, -1))});
        lua_pop(L, 2);
    }
    return 0;
}

// native.read_module(name), native.read_node(name): return text and chunk name, or nil and the searched paths.
template <bool node>
int read_source(State& state)
{
    std::string looked_in;
    lua_State* L = state.lua();
    const auto source = state.host().modules.find(text_at(L, 1), node, looked_in);
    if (!source) {
        lua_pushnil(L);
        push_text(L, looked_in);
        return 2;
    }
    push_text(L, source->text);
    push_text(L, "@" + source->name);
    return 2;
}

void push_names(lua_State* L, const std::vector<std::string>& names)
{
    lua_createtable(L, static_cast<int>(names.size()), 0);
    for (std::size_t i = 0; i < names.size(); ++i) {
        push_text(L, names[i]);
        lua_rawseti(L, -2, static_cast<int>(i) + 1);
    }
}

// native.maker_names(family): returns the makers of a family by their names in it: "shape" gives box, plane, sphere.
int maker_names(State& state)
{
    const std::string prefix = text_at(state.lua(), 1) + ".";
    std::vector<std::string> names;
    for (const Maker* maker : all_makers())
        if (maker->name.rfind(prefix, 0) == 0) names.push_back(maker->name.substr(prefix.size()));
    push_names(state.lua(), names);
    return 1;
}

// native.defaults(maker): returns the defaults of its parameters by name.
int push_defaults(State& state)
{
    std::map<std::string, Value> defaults;
    for (const Param& param : find_maker(text_at(state.lua(), 1)).params)
        if (!param.fallback.is_nil()) defaults[param.name] = param.fallback;
    push(state, std::move(defaults));
    return 1;
}

// native.point_names: { fields = { names }, methods = { names }, read_only = { NAME = true } }.
void push_point_names(lua_State* L)
{
    lua_newtable(L);
    push_names(L, point_names_of(PointName::Field));
    lua_setfield(L, -2, "fields");
    push_names(L, point_names_of(PointName::Method));
    lua_setfield(L, -2, "methods");
    lua_newtable(L);
    for (const PointName& known : point_names) {
        if (!known.read_only) continue;
        push_text(L, known.name);
        lua_pushboolean(L, 1);
        lua_rawset(L, -3);
    }
    lua_setfield(L, -2, "read_only");
}

}  // namespace

void push_natives(State& state, const std::string& chunk_header)
{
    lua_State* L = state.lua();
    constexpr luaL_Reg functions[] = {{"make", native<make_object>},
                                      {"maker_names", native<maker_names>},
                                      {"defaults", native<push_defaults>},
                                      {"attribute", native<make_attribute>},
                                      {"host", native<take_offer>},
                                      {"param", native<declare_parameter>},
                                      {"node", native<make_node>},
                                      {"define", native<define_node_type>},
                                      {"complete", native<complete_arguments>},
                                      {"has_type", native<has_type>},
                                      {"unknown_type", native<unknown_type>},
                                      {"did_you_mean", native<suggest>},
                                      {"kind", native<kind_of>},
                                      {"names_frames", native<names_frames>},
                                      {"require_memory", native<require_memory>},
                                      {"text", native<text_of_number>},
                                      {"number", native<number_of_text>},
                                      {"print", native<print_text>},
                                      {"set_index", native<set_object_methods>},
                                      {"run", run_body},
                                      {"shape", native<pointer_to_shape>},
                                      {"vector_grid", native<pointer_to<VectorGrid>>},
                                      {"fog", native<pointer_to<DensityGrid>>},
                                      {"mesh", native<pointer_to_mesh>},
                                      {"outside_kernels", native<outside_kernels>},
                                      {"trace_aborted", native<trace_aborted>},
                                      {"add_code", native<add_code>},
                                      {"read_module", native<read_source<false>>},
                                      {"read_node", native<read_source<true>>}};
    lua_newtable(L);
    for (const luaL_Reg& function : functions) {
        lua_pushcfunction(L, function.func);
        lua_setfield(L, -2, function.name);
    }
    lua_pushboolean(L, !state.is_main() || state.host().options().quiet);
    lua_setfield(L, -2, "is_quiet");
    lua_pushboolean(L, state.is_main() && state.host().options().keeps_state);
    lua_setfield(L, -2, "keeps_state");
    push_detail_natives(state);
    lua_setfield(L, -2, "detail");
    push_text(L, chunk_header);
    lua_setfield(L, -2, "chunk_header");
    push_text(L, state.memory_limit_text());
    lua_setfield(L, -2, "memory_limit_text");
    push_text(L, name_of(Setting::Output));
    lua_setfield(L, -2, "output_setting");
    push_text(L, name_of(Setting::Cache));
    lua_setfield(L, -2, "cache_setting");
    push_point_names(L);
    lua_setfield(L, -2, "point_names");
    set_kernel_functions(L);
}

}  // namespace rapid
