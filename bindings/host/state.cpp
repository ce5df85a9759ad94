#include "bindings/host/state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <lua.hpp>
#include <utility>

#include "bindings/host/compiled_code.h"
#include "bindings/host/kernel_lanes.h"
#include "bindings/host/lua_text.h"
#include "bindings/host/modules.h"
#include "bindings/host/natives.h"
#include "bindings/host/script_error.h"
#include "bindings/host/script_host.h"
#include "bindings/host/values.h"
#include "runtime/base/setting_names.h"

namespace rapid {
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

}  // namespace rapid
