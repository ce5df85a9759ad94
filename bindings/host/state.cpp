#include "bindings/host/state.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <unwind.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <lua.hpp>
#include <string>
#include <utility>

#include "bindings/host/construct.h"
#include "bindings/host/detail.h"
#include "bindings/host/graph_node.h"
#include "bindings/host/graph_parameter.h"
#include "bindings/host/kernel_functions.h"
#include "bindings/host/kernel_lanes.h"
#include "bindings/host/kernel_pass.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/maker.h"
#include "bindings/host/modules.h"
#include "bindings/host/script_error.h"
#include "bindings/host/script_host.h"
#include "bindings/host/script_type.h"
#include "bindings/host/values.h"
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

// The table of native functions passed to lua/host.lua.

class State;

// Pushes the table. chunk_header: the text of lua/chunk.h.
void push_natives(State& state, const std::string& chunk_header);

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

namespace {

constexpr char state_field[] = "rapid.state";  // in the registry

std::string read_text(const std::filesystem::path& path)
{
    std::optional<std::string> text = read_lua_file(path);
    if (!text) throw Error(fmt::format("can't read {}: Rapid's own Lua files are missing", path.string()));
    return std::move(*text);
}

// Removes the current folder from the search path. Lua looks there first, and it may contain untrusted scenes: the host
// loads its modules from fixed folders only.
void leave_out_current_folder(lua_State* L)
{
    lua_getglobal(L, "package");
    for (const char* field : {"path", "cpath"}) {
        lua_getfield(L, -1, field);
        const std::string all = text_at(L, -1);
        lua_pop(L, 1);
        std::string absolute;
        for (std::size_t begin = 0; begin < all.size();) {
            const std::size_t end = std::min(all.find(';', begin), all.size());
            if (all[begin] == '/') absolute += all.substr(begin, end - begin) + ';';
            begin = end + 1;
        }
        push_text(L, absolute);
        lua_setfield(L, -2, field);
    }
    lua_pop(L, 1);
}

// Returns LuaJIT's description of its bytecode, from one of the folders of package.path; empty if none has it.
std::filesystem::path bytecode_description(lua_State* L)
{
    lua_getglobal(L, "package");
    lua_getfield(L, -1, "path");
    const std::string all = text_at(L, -1);
    lua_pop(L, 2);
    for (std::size_t begin = 0; begin < all.size();) {
        const std::size_t end = std::min(all.find(';', begin), all.size());
        std::string file = all.substr(begin, end - begin);
        if (const std::size_t mark = file.find('?'); mark != file.npos) file.replace(mark, 1, "jit/vmdef");
        if (std::filesystem::exists(file)) return file;
        begin = end + 1;
    }
    return {};
}

// Pushes a chunk of Rapid's own Lua. Throws Error if it does not compile or memory runs out.
void load_own(lua_State* L, const std::string& text, const std::string& name)
{
    if (const int status = luaL_loadbuffer(L, text.data(), text.size(), name.c_str()); status != 0)
        throw Error(lua_tostring(L, -1), status == LUA_ERRMEM ? ErrorKind::OutOfMemory : ErrorKind::Fault);
}

// Makes require(name) run the file.
void preload(lua_State* L, const std::string& name, const std::filesystem::path& file)
{
    lua_getglobal(L, "package");
    lua_getfield(L, -1, "preload");
    load_own(L, read_text(file), fmt::format("=[rapid {}]", name));
    lua_setfield(L, -2, name.c_str());
    lua_pop(L, 2);
}

}  // namespace

State::State(ScriptHost& host, bool main) : host_(host), main_(main), slot_(host.interruption)
{
    make();
    if (!L_) throw std::bad_alloc();
    const std::exception_ptr error = set_up();
    if (!error) return;
    close();
    if (is_at_limit_) throw beyond_limit();
    std::rethrow_exception(error);
}

// Makes the state. If memory runs out after its first block, LuaJIT closes the incomplete state as if it were complete,
// and crashes. The failing allocation therefore leaves by a jump, over C functions only, and the partial state, some
// kilobytes, is leaked.
void State::make()
{
    std::jmp_buf jump_target;
    making_ = &jump_target;
    if (setjmp(jump_target) == 0) L_ = lua_newstate(allocate, this);
    making_ = nullptr;
}

// Runs in a protected call, since Lua's own error (out of memory) is not a C++ exception: catching it as one would make
// it impossible to rethrow.
std::exception_ptr State::set_up()
{
    struct SetUp {
        State& state;
        std::exception_ptr error;
        sigjmp_buf jump_target;
    } now{*this, nullptr, {}};
    const Protected inside(*this);
    if (sigsetjmp(now.jump_target, 0) != 0) return now.error;
    const int status = lua_cpcall(
        L_,
        [](lua_State* L) {
            SetUp& here = *static_cast<SetUp*>(lua_touserdata(L, 1));
            lua_pushlightuserdata(L, &here.state);
            lua_setfield(L, LUA_REGISTRYINDEX, state_field);
            try {
                here.state.open_libraries();
                register_objects(L);
                here.state.run_host_file();
            } catch (const std::exception&) {
                here.error = std::current_exception();
            }
            if (here.state.is_broken_) siglongjmp(here.jump_target, 1);
            return 0;
        },
        &now);
    if (now.error || status == 0) return now.error;
    if (status == LUA_ERRMEM) return std::make_exception_ptr(std::bad_alloc());
    return std::make_exception_ptr(Error(lua_tostring(L_, -1)));
}

State::~State() { close(); }

// LuaJIT cannot close a state that a jump has left, nor one whose ffi library is incomplete. Their memory is leaked.
void State::close()
{
    if (is_broken_ || !has_libraries_) return;
    protected_ = true;  // Lua calls finalizers protected, and nothing else in it allocates
    lua_close(L_);
}

State& State::of(lua_State* L)
{
    lua_getfield(L, LUA_REGISTRYINDEX, state_field);
    State* state = static_cast<State*>(lua_touserdata(L, -1));
    lua_pop(L, 1);
    return *state;
}

// Lua's memory per state is limited while scripts run: a request beyond the limit is Lua's own out-of-memory error. The
// host's own requests between them are not limited.
//
// Outside of a protected call Lua's error would end the process silently. Running out of memory there throws a C++
// exception, which leaves Lua where its own error would. Within compiled code LuaJIT raises the error from the wrong
// position, so the call is left by a jump.
void* State::allocate(void* self, void* block, std::size_t old_size, std::size_t new_size)
{
    State& state = *static_cast<State*>(self);
    if (new_size == 0) {
        std::free(block);
        state.memory_ -= old_size;
        return nullptr;
    }
    const bool is_beyond_limit = state.limited_ && new_size > old_size &&
                                 state.memory_ + (new_size - old_size) > state.host_.options().script_memory;
    void* moved = is_beyond_limit ? nullptr : std::realloc(block, new_size);
    if (!moved && block && new_size <= old_size) moved = block;  // Lua assumes that a block can shrink
    if (moved)
        state.memory_ += new_size - old_size;
    else
        state.is_at_limit_ = is_beyond_limit;
    if (moved) return moved;
    if (state.making_ && state.memory_ > 0)
        std::longjmp(*state.making_, 1);
    else if (state.L_ && !state.protected_)
        throw std::bad_alloc();
    else if (state.protected_ && is_called_by_compiled_code())
        Interruption::Call::try_to_leave(state.slot_);
    return nullptr;
}

void State::open_libraries()
{
    luaL_openlibs(L_);
    // LuaJIT opens its ffi library when a script first asks for it. It is opened here, so that close() knows that it is
    // complete.
    lua_pushcfunction(L_, luaopen_ffi);
    lua_call(L_, 0, 0);
    has_libraries_ = true;
    leave_out_current_folder(L_);
    // Our modules are found in one folder, and named so that a position in them is never taken for graph code.
    const std::filesystem::path folder = lua_folder();
    for (const char* name :
         {"elementary", "describe", "engine_errors", "vec3",    "bytecode", "lane_program", "lane_calls",
          "lanes",      "kernel",   "detail",        "numeric", "shape",    "ramp",         "power_operator",
          "protected",  "sandbox",  "shared_state",  "study",   "text",     "rapid"})
        preload(L_, name, folder / (std::string(name) + ".lua"));
    // Its own loader reports a file as missing if memory runs out.
    if (const auto file = bytecode_description(L_); !file.empty()) preload(L_, "jit.vmdef", file);
}

void State::run_host_file()
{
    const std::filesystem::path folder = lua_folder();
    load_own(L_, read_text(folder / "host.lua"), "=[rapid host]");
    push_natives(*this, read_text(folder / "chunk.h"));
    call(1, 1);
    entries_ = luaL_ref(L_, LUA_REGISTRYINDEX);
    push_entry("engine_errors");
    set_engine_errors(L_);
    if (host_.options().on_trace_abort) {
        push_entry("watch_traces");
        call(0, 0);
    }
}

void State::call(int arguments, int results)
{
    const int base = lua_gettop(L_) - arguments;  // index of the function
    lua_pushcfunction(L_, describe_error);
    lua_insert(L_, base);
    const int status = [&] {
        const Protected inside(*this);
        const struct Limited {
            bool& now;
            const bool before;
            ~Limited() { now = before; }
        } limited{limited_, std::exchange(limited_, true)};
        return protected_call(arguments, results, base);
    }();
    lua_remove(L_, base);
    if (status != 0) throw take_error(L_, status);
}

// Returns the status of lua_pcall.
int State::protected_call(int arguments, int results, int handler)
{
    if (is_broken_) fail_broken();
    Interruption::Call call(slot_, L_);
    if (sigsetjmp(call.jump_target, 0) == 0) return lua_pcall(L_, arguments, results, handler);
    call.after_jump();
    is_broken_ = true;
    fail_broken();
}

void State::fail_broken() const
{
    host_.interruption.check();
    if (is_at_limit_) throw beyond_limit();
    throw std::bad_alloc();
}

void State::pass(const Error& error)
{
    if (error.kind() == ErrorKind::Fault) return;
    passed_ = error.what();
    passed_kind_ = error.kind();
}

ErrorKind State::kind_of(const std::string& text) const
{
    if (!passed_.empty() && text.find(passed_) != text.npos) return passed_kind_;
    const Interruption& interruption = host_.interruption;
    if (interruption.is_requested() && text.find(interruption.why().message()) != text.npos)
        return interruption.why().kind();
    return ErrorKind::Fault;
}

Error State::beyond_limit() const { return Error(memory_limit_text(), ErrorKind::OutOfMemory); }

std::string State::memory_limit_text() const
{
    const std::size_t most = host_.options().script_memory;
    const std::string text = most >> 20 ? fmt::format("{} MiB", most >> 20) : fmt::format("{} bytes", most);
    return fmt::format("the script needs more than {} of Lua memory; {} sets the limit", text,
                       name_of(Setting::ScriptMemory));
}

void State::leave_if_broken() const
{
    if (is_broken_) Interruption::Call::leave(slot_);
}

void State::push_entry(const char* name)
{
    lua_rawgeti(L_, LUA_REGISTRYINDEX, entries_);
    lua_getfield(L_, -1, name);
    lua_remove(L_, -2);
}

void State::set_loaded()
{
    push_entry("loaded");
    call(0, 0);
    loaded_ = true;
}

void State::push_kernel(std::size_t kernel) { lua_rawgeti(L_, LUA_REGISTRYINDEX, kernel_references_[kernel]); }

std::size_t State::add_kernel()
{
    kernel_references_.push_back(luaL_ref(L_, LUA_REGISTRYINDEX));
    return kernel_references_.size() - 1;
}

namespace {

struct Walk {
    const void* luajit;  // start of the library
    bool is_in_luajit = false;
    bool is_compiled = false;
};

// Skips the frames of the allocator and of LuaJIT, and examines their caller: compiled code belongs to no file.
_Unwind_Reason_Code visit(_Unwind_Context* frame, void* data)
{
    Walk& walk = *static_cast<Walk*>(data);
    dl_find_object object;
    if (_dl_find_object(reinterpret_cast<void*>(_Unwind_GetIP(frame)), &object) != 0) {
        walk.is_compiled = walk.is_in_luajit;
        return _URC_NORMAL_STOP;
    }
    if (object.dlfo_map_start == walk.luajit)
        walk.is_in_luajit = true;
    else if (walk.is_in_luajit)
        return _URC_NORMAL_STOP;
    return _URC_NO_REASON;
}

}  // namespace

bool is_called_by_compiled_code()
{
    dl_find_object luajit;
    if (_dl_find_object(reinterpret_cast<void*>(&lua_gettop), &luajit) != 0) return false;
    Walk walk{luajit.dlfo_map_start};
    _Unwind_Backtrace(visit, &walk);
    return walk.is_compiled;
}

}  // namespace rapid
