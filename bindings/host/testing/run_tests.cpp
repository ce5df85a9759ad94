#include "bindings/host/testing/run_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <lua.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "bindings/host/lua_text.h"
#include "bindings/host/modules.h"
#include "bindings/host/session.h"
#include "bindings/host/testing/test_points.h"
#include "runtime/base/threads.h"
#include "runtime/graph/evaluate.h"

namespace rapid {
namespace {

// Context of the functions that Lua calls.
struct Host {
    const TestOptions& options;
    const std::function<void(const TestEvent&)>& report;
};

Host& host_of(lua_State* L) { return *static_cast<Host*>(lua_touserdata(L, lua_upvalueindex(1))); }

std::optional<double> number_field(lua_State* L, int table, const char* name)
{
    lua_getfield(L, table, name);
    std::optional<double> number;
    if (lua_isnumber(L, -1)) number = lua_tonumber(L, -1);
    lua_pop(L, 1);
    return number;
}

bool flag_field(lua_State* L, int index, const char* name)
{
    lua_getfield(L, index, name);
    const bool flag = lua_toboolean(L, -1) != 0;
    lua_pop(L, 1);
    return flag;
}

struct SceneRun {
    std::string graph;
    std::int64_t first = 0, last = 0;
    std::optional<std::uint64_t> seed;
    int threads = 0;
    SessionOptions session;
    bool check_declarations = false;
    bool watch_lanes = false;
    bool watch_traces = false;  // only on request: the JIT's events are not safe in every run
};

// Reads the arguments (path, options) of lua/testing/rapid.lua, which has checked them.
SceneRun read_run(lua_State* L)
{
    const Host& host = host_of(L);
    SceneRun run;
    run.graph = checked_text_at(L, 1);
    run.first = static_cast<std::int64_t>(number_field(L, 2, "first").value_or(0));
    run.last = static_cast<std::int64_t>(number_field(L, 2, "last").value_or(0));
    if (const auto seed = number_field(L, 2, "seed")) run.seed = static_cast<std::uint64_t>(*seed);
    run.threads = static_cast<int>(number_field(L, 2, "threads").value_or(host.options.threads));
    if (const auto seconds = number_field(L, 2, "script_timeout")) run.session.script_timeout = *seconds;
    run.session.on_timeout = host.options.on_timeout;
    run.session.interruptible = true;
    run.session.may_write = false;
    run.check_declarations = flag_field(L, 2, "check_declarations");
    run.watch_lanes = flag_field(L, 2, "watch_lanes");
    run.watch_traces = flag_field(L, 2, "watch_traces");
    lua_getfield(L, 2, "set");
    for (lua_pushnil(L); lua_next(L, -2); lua_pop(L, 1))
        run.session.set[checked_text_at(L, -2)] = checked_text_at(L, -1);
    lua_pop(L, 1);
    return run;
}

// Runs the scene and returns its distinct warnings. Passes frames from run.first on to `keep`.
std::vector<std::string> run_scene(const SceneRun& run, const std::function<void(FrameResult&)>& keep)
{
    Threads threads(run.threads);
    return threads.run([&] {
        Session session(run.graph, run.session);
        const Plan plan(session.graph(), {run.seed, {}});
        if (run.first < plan.first_frame())
            throw Error(fmt::format("frames: {} is before the scene's first frame, {}", run.first, plan.first_frame()));
        std::vector<std::string> warnings;
        const auto add = [&](const std::vector<std::string>& found) {
            for (const std::string& warning : found)
                if (std::find(warnings.begin(), warnings.end(), warning) == warnings.end()) warnings.push_back(warning);
        };
        add(session.take_warnings());
        add(plan.warnings);
        Evaluator evaluator(plan);
        evaluator.disable_error_estimates();
        if (run.check_declarations) evaluator.check_declarations();
        while (evaluator.next_frame() <= run.last) {
            FrameResult result = evaluator.advance();
            add(session.take_warnings());
            add(result.warnings);
            if (result.frame >= run.first) keep(result);
        }
        return warnings;
    });
}

void push_list(lua_State* L, const std::vector<std::string>& strings)
{
    lua_newtable(L);
    for (std::size_t i = 0; i < strings.size(); ++i) {
        lua_pushstring(L, strings[i].c_str());
        lua_rawseti(L, -2, static_cast<int>(i) + 1);
    }
}

// native.run(path, options): returns point sets by output and frame; the warnings, in order; the traces that LuaJIT
// gave up; and the kernels that are not programs of lanes.
int run(lua_State* L)
{
    std::string error;
    try {
        SceneRun scene = read_run(L);
        std::mutex mutex;
        std::vector<std::string> aborts;
        if (scene.watch_traces)
            scene.session.on_trace_abort = [&](const std::string& message) {
                const std::lock_guard lock(mutex);
                aborts.push_back(message);
            };
        std::vector<std::string> no_lanes;
        if (scene.watch_lanes)
            scene.session.on_no_lanes = [&](const std::string& message) {
                const std::lock_guard lock(mutex);
                no_lanes.push_back(message);
            };
        lua_newtable(L);
        const int outputs = lua_gettop(L);
        const std::vector<std::string> warnings = run_scene(scene, [&](FrameResult& result) {
            for (auto& [name, points] : result.outputs) {
                lua_getfield(L, outputs, name.c_str());
                if (lua_isnil(L, -1)) {
                    lua_pop(L, 1);
                    lua_newtable(L);
                    lua_pushvalue(L, -1);
                    lua_setfield(L, outputs, name.c_str());
                }
                push_points(L, points,
                            result.outputs.size() == 1 ? fmt::format("frame {}", result.frame)
                                                       : fmt::format("frame {}, output {}", result.frame, name));
                lua_rawseti(L, -2, static_cast<int>(result.frame));
                lua_pop(L, 1);
            }
        });
        push_list(L, warnings);
        push_list(L, aborts);
        push_list(L, no_lanes);
        return 4;
    } catch (const Error& raised) {
        error = raised.what();
    }
    lua_pushlstring(L, error.data(), error.size());
    error = {};  // lua_error() must not skip destructors
    return lua_error(L);
}

// tell(kind, name, message): reports an event.
int report(lua_State* L)
{
    constexpr const char* kinds[] = {"started", "passed", "failed", "skipped", "broken", nullptr};
    host_of(L).report({static_cast<TestEvent::Kind>(luaL_checkoption(L, 1, nullptr, kinds)), checked_text_at(L, 2),
                       luaL_optstring(L, 3, "")});
    return 0;
}

void push_function(lua_State* L, Host& host, const char* name, lua_CFunction function)
{
    lua_pushlightuserdata(L, &host);
    lua_pushcclosure(L, function, 1);
    lua_setfield(L, -2, name);
}

// Puts Rapid's own modules first.
void set_path(lua_State* L)
{
    lua_getglobal(L, "package");
    lua_getfield(L, -1, "path");
    const std::string path = fmt::format("{}/?.lua;{}", lua_folder().string(), lua_tostring(L, -1));
    lua_pop(L, 1);
    lua_pushlstring(L, path.data(), path.size());
    lua_setfield(L, -2, "path");
    lua_pop(L, 1);
}

}  // namespace

void run_test_file(const std::filesystem::path& file, const TestOptions& options,
                   const std::function<void(const TestEvent&)>& on_event)
{
    Host host{options, on_event};
    const std::unique_ptr<lua_State, decltype(&lua_close)> state(luaL_newstate(), &lua_close);
    lua_State* L = state.get();
    luaL_openlibs(L);
    set_path(L);

    const std::string runner = (lua_folder() / "testing/runner.lua").string();
    if (luaL_loadfile(L, runner.c_str()) != 0) throw Error(lua_tostring(L, -1));
    lua_newtable(L);
    push_function(L, host, "run", run);
    push_function(L, host, "tell", report);
    register_points(L);
    lua_pushstring(L, file.c_str());
    lua_pushstring(L, options.filter.c_str());
    lua_pushinteger(L, options.already_run);
    if (lua_pcall(L, 4, 0, 0) != 0) throw Error(lua_tostring(L, -1));
}

}  // namespace rapid
