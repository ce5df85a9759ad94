#include "bindings/host/testing/run_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <lua.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "bindings/host/lua_text.h"
#include "bindings/host/modules.h"
#include "bindings/host/session.h"
#include "runtime/base/error.h"
#include "runtime/base/threads.h"
#include "runtime/graph/evaluate.h"
#include "runtime/points/point_set.h"

struct lua_State;

namespace rapid {

// source: for messages, "frame 48", "frame 48, output sparks".
void push_points(lua_State* L, PointSet points, std::string source);

// Adds the functions on points to the table at the top of the stack, and `points_metatable`, whose __index Lua sets.
void register_points(lua_State* L);

namespace {

// Checks of whole point sets, for assertions. Each returns the first fault as text, or nothing.

// The points of a scene's frame, as a test sees them.

struct TestedPoints {
    PointSet set;
    std::string source;                                     // for messages: "frame 48", "frame 48, output sparks"
    std::unordered_map<std::int64_t, std::size_t> indices;  // index by id; built on first use
};

// A value as numbers: 1, 3 (vec3), 4 (quaternion, x y z w) or none (a string).
struct Numbers {
    int count = 1;
    double x[4] = {};
};
inline Numbers numbers_of(const Vec3f& v) { return {3, {v.x(), v.y(), v.z()}}; }
inline Numbers numbers_of(const Quatf& q) { return {4, {q.x(), q.y(), q.z(), q.w()}}; }
inline Numbers numbers_of(Token) { return {0}; }
template <class T>
Numbers numbers_of(T value)
{
    return {1, {static_cast<double>(value)}};
}

std::string text_of(const Numbers& numbers)
{
    if (numbers.count == 1) return fmt::format("{}", numbers.x[0]);
    return fmt::format("{{{}}}", fmt::join(numbers.x, numbers.x + numbers.count, ", "));
}

template <class T>
std::string text_of_value(const T& value)
{
    if constexpr (std::is_same_v<T, Token>)
        return fmt::format("\"{}\"", value.text());
    else
        return text_of(numbers_of(value));
}

std::string point_text(const TestedPoints& points, std::size_t place)
{
    return fmt::format("{}, point {} (id {})", points.source, place + 1, points.set.id()[place]);
}

// Returns the first bitwise difference of two columns of one type, as text.
std::optional<std::string> first_difference(const TestedPoints& a, const std::string& name, const AnyColumn& column_a,
                                            const AnyColumn& column_b)
{
    return std::visit(
        [&](const auto& values_a) -> std::optional<std::string> {
            const auto& values_b = std::get<std::decay_t<decltype(values_a)>>(column_b);
            for (std::size_t i = 0; i < values_a.size(); ++i)
                if (std::memcmp(&values_a[i], &values_b[i], sizeof values_a[i]) != 0)
                    return fmt::format("{}: {} is {} and {}", point_text(a, i), name, text_of_value(values_a[i]),
                                       text_of_value(values_b[i]));
            return std::nullopt;
        },
        column_a);
}

// Returns the first difference of sizes and names.
std::optional<std::string> first_difference_in_shape(const TestedPoints& a, const TestedPoints& b)
{
    if (a.set.size() != b.set.size())
        return fmt::format("{} has {} points and {} has {}", a.source, a.set.size(), b.source, b.set.size());
    if (a.set.column_names() != b.set.column_names())
        return fmt::format("{} has the attributes {} and {} has {}", a.source, fmt::join(a.set.column_names(), ", "),
                           b.source, fmt::join(b.set.column_names(), ", "));
    if (a.set.group_names() != b.set.group_names())
        return fmt::format("{} has the groups {} and {} has {}", a.source, fmt::join(a.set.group_names(), ", "),
                           b.source, fmt::join(b.set.group_names(), ", "));
    return std::nullopt;
}

// Returns a value that is neither finite nor the life of a point that never dies.
std::optional<std::string> first_not_finite(const TestedPoints& points)
{
    for (const auto& [name, any] : points.set.columns()) {
        std::optional<std::string> found = std::visit(
            [&, &attribute = name](const auto& column) -> std::optional<std::string> {
                for (std::size_t i = 0; i < column.size(); ++i) {
                    const Numbers numbers = numbers_of(column[i]);
                    // Infinity is the life of a point that never dies.
                    const bool life = attribute == "life";
                    if (std::all_of(numbers.x, numbers.x + numbers.count,
                                    [&](double x) { return std::isfinite(x) || (life && x > 0); }))
                        continue;
                    return fmt::format("{}: {} is {}", point_text(points, i), attribute, text_of(numbers));
                }
                return std::nullopt;
            },
            any);
        if (found) return found;
    }
    return std::nullopt;
}

std::optional<std::string> first_difference(const TestedPoints& a, const TestedPoints& b)
{
    if (auto found = first_difference_in_shape(a, b)) return found;
    for (const auto& [name, column] : a.set.columns()) {
        const AnyColumn& other = *b.set.find(name);
        if (type_of(column) != type_of(other))
            return fmt::format("{} is {} and {}", name, type_name(type_of(column)), type_name(type_of(other)));
        if (auto found = first_difference(a, name, column, other)) return found;
    }
    for (const auto& [name, members] : a.set.groups()) {
        const Column<std::uint8_t>& other = *b.set.find_group(name);
        for (std::size_t i = 0; i < members.size(); ++i)
            if (members[i] != other[i])
                return fmt::format("{}: {} in group {}", point_text(a, i), members[i] ? "only first" : "only second",
                                   name);
    }
    return std::nullopt;
}

constexpr const char* metatable = "rapid.points";

TestedPoints& points_at(lua_State* L, int index)
{
    return **static_cast<TestedPoints**>(luaL_checkudata(L, index, metatable));
}

// Turns an Error into a Lua error with exactly its text.
template <int (*function)(lua_State*)>
int guarded(lua_State* L)
{
    try {
        return function(L);
    } catch (const Error& error) {
        lua_pushstring(L, error.what());
    }
    return lua_error(L);
}

int push(lua_State* L, const Numbers& numbers)
{
    for (int k = 0; k < numbers.count; ++k) lua_pushnumber(L, numbers.x[k]);
    return numbers.count;
}

const AnyColumn& column_of(const TestedPoints& points, const std::string& name)
{
    if (const AnyColumn* column = points.set.find(name)) return *column;
    throw Error(fmt::format("{} has no attribute \"{}\"{}", points.source, name,
                            did_you_mean(name, points.set.column_names())));
}

int size(lua_State* L)
{
    lua_pushinteger(L, static_cast<lua_Integer>(points_at(L, 1).set.size()));
    return 1;
}

int source(lua_State* L)
{
    lua_pushstring(L, points_at(L, 1).source.c_str());
    return 1;
}

int push_list_of_names(lua_State* L, const std::vector<std::string>& names)
{
    lua_newtable(L);
    int i = 0;
    for (const std::string& name : names) {
        lua_pushstring(L, name.c_str());
        lua_rawseti(L, -2, ++i);
    }
    return 1;
}

int names(lua_State* L) { return push_list_of_names(L, points_at(L, 1).set.column_names()); }

int group_names(lua_State* L) { return push_list_of_names(L, points_at(L, 1).set.group_names()); }

// value(points, index from 1, name): returns the numbers of the value, or its string.
int value(lua_State* L)
{
    const TestedPoints& points = points_at(L, 1);
    const auto place = static_cast<std::size_t>(luaL_checkinteger(L, 2)) - 1;
    const AnyColumn& any = column_of(points, checked_text_at(L, 3));
    if (const auto* strings = std::get_if<Column<Token>>(&any)) {
        const std::string_view text = (*strings)[place].text();
        return lua_pushlstring(L, text.data(), text.size()), 1;
    }
    return std::visit([&](const auto& column) { return push(L, numbers_of(column[place])); }, any);
}

const Column<std::uint8_t>& group_of(const TestedPoints& points, const std::string& name)
{
    if (const Column<std::uint8_t>* group = points.set.find_group(name)) return *group;
    throw Error(
        fmt::format("{} has no group \"{}\"{}", points.source, name, did_you_mean(name, points.set.group_names())));
}

// within(points, index from 1, group): returns true if the point is in the group.
int within(lua_State* L)
{
    const auto place = static_cast<std::size_t>(luaL_checkinteger(L, 2)) - 1;
    lua_pushboolean(L, group_of(points_at(L, 1), checked_text_at(L, 3))[place] != 0);
    return 1;
}

// place_of(points, id): returns the index from 1, or nil if no point has the id.
int place_of(lua_State* L)
{
    TestedPoints& points = points_at(L, 1);
    if (points.indices.empty())
        for (std::size_t i = 0; i < points.set.size(); ++i) points.indices.emplace(points.set.id()[i], i);
    const auto found = points.indices.find(static_cast<std::int64_t>(luaL_checknumber(L, 2)));
    if (found == points.indices.end()) return 0;
    lua_pushinteger(L, static_cast<lua_Integer>(found->second) + 1);
    return 1;
}

int group(lua_State* L)
{
    const TestedPoints& points = points_at(L, 1);
    const std::string name = checked_text_at(L, 2);
    const Column<std::uint8_t>& members = group_of(points, name);
    std::vector<std::uint8_t> mask(points.set.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = members[i];
    PointSet subset = points.set;
    subset.keep(mask);
    push_points(L, std::move(subset), fmt::format("{}, group {}", points.source, name));
    return 1;
}

// A NaN among the values makes the result NaN: comparisons with it are false, so no test overlooks it.
double folded(const std::string& what, double so_far, double x)
{
    if (std::isnan(x) || std::isnan(so_far)) return std::numeric_limits<double>::quiet_NaN();
    return what == "min" ? std::min(so_far, x) : what == "max" ? std::max(so_far, x) : so_far + x;
}

// reduce(points, name, "min" | "max" | "mean"): reduces each component. Without points: inf, -inf and NaN.
int reduce(lua_State* L)
{
    const std::string what = checked_text_at(L, 3), name = checked_text_at(L, 2);
    if (type_of(column_of(points_at(L, 1), name)) == AttributeType::String)
        throw Error(fmt::format("the attribute \"{}\" is a string, which has no {}", name, what));
    const double start = what == "min"   ? std::numeric_limits<double>::infinity()
                         : what == "max" ? -std::numeric_limits<double>::infinity()
                                         : 0;
    return std::visit(
        [&](const auto& column) {
            Numbers result = numbers_of(std::decay_t<decltype(column)>::zero());
            std::fill_n(result.x, result.count, start);
            for (std::size_t i = 0; i < column.size(); ++i) {
                const Numbers numbers = numbers_of(column[i]);
                for (int k = 0; k < result.count; ++k) result.x[k] = folded(what, result.x[k], numbers.x[k]);
            }
            if (what == "mean")
                for (int k = 0; k < result.count; ++k) result.x[k] /= static_cast<double>(column.size());
            return push(L, result);
        },
        column_of(points_at(L, 1), name));
}

int push_fault(lua_State* L, const std::optional<std::string>& fault)
{
    if (!fault) return 0;
    lua_pushstring(L, fault->c_str());
    return 1;
}

// not_finite(points): returns the first value that is not finite, or nil.
int not_finite(lua_State* L) { return push_fault(L, first_not_finite(points_at(L, 1))); }

// difference(a, b): returns the first bitwise difference, or nil.
int difference(lua_State* L) { return push_fault(L, first_difference(points_at(L, 1), points_at(L, 2))); }

int collect(lua_State* L)
{
    delete &points_at(L, 1);
    return 0;
}

}  // namespace

void push_points(lua_State* L, PointSet points, std::string source)
{
    auto* place = static_cast<TestedPoints**>(lua_newuserdata(L, sizeof(TestedPoints*)));
    *place = new TestedPoints{std::move(points), std::move(source), {}};
    luaL_getmetatable(L, metatable);
    lua_setmetatable(L, -2);
}

void register_points(lua_State* L)
{
    const luaL_Reg functions[] = {{"size", guarded<size>},
                                  {"source", guarded<source>},
                                  {"names", guarded<names>},
                                  {"group_names", guarded<group_names>},
                                  {"value", guarded<value>},
                                  {"within", guarded<within>},
                                  {"place_of", guarded<place_of>},
                                  {"group", guarded<group>},
                                  {"reduce", guarded<reduce>},
                                  {"not_finite", guarded<not_finite>},
                                  {"difference", guarded<difference>}};
    for (const luaL_Reg& function : functions) {
        lua_pushcfunction(L, function.func);
        lua_setfield(L, -2, function.name);
    }
    luaL_newmetatable(L, metatable);
    lua_pushcfunction(L, collect);
    lua_setfield(L, -2, "__gc");
    lua_pushcfunction(L, guarded<size>);
    lua_setfield(L, -2, "__len");
    lua_setfield(L, -2, "points_metatable");
}

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
