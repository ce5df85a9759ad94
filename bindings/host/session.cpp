#include "bindings/host/session.h"

#include <fmt/format.h>

#include <lua.hpp>
#include <utility>

#include "bindings/host/lua_text.h"
#include "bindings/host/maker.h"
#include "bindings/host/script_host.h"
#include "bindings/host/values.h"
#include "runtime/graph/points_object.h"

namespace rapid {

Session::Session(const std::filesystem::path& file, SessionOptions options)
    : host_(std::make_unique<ScriptHost>(file, std::move(options)))
{
}

Session::~Session() = default;

const Graph& Session::graph() const { return host_->graph; }
const Registry& Session::registry() const { return host_->registry; }
const std::vector<Session::Parameter>& Session::parameters() const { return host_->parameters; }
const std::map<std::string, std::vector<Session::FunctionCode>>& Session::code() const { return host_->code; }
std::vector<std::string> Session::take_warnings() { return std::exchange(host_->warnings, {}); }

void Session::use_from_this_thread() { host_->use_from_this_thread(); }
void Session::interrupt(const Error& why) { host_->interruption.request(why); }
bool Session::is_interrupted() const { return host_->interruption.is_requested(); }

Registry Session::all_node_types()
{
    ScriptHost host({}, SessionOptions{});
    host.load_shipped_nodes();
    return host.registry;
}

// A session of a study file: its description, its closed form and its own measure of error (lua/study.lua).

namespace {

// Appends the numbers of one value, as lua/study.lua takes them.
void append(lua_State* L, int& index, float value)
{
    lua_pushnumber(L, static_cast<double>(value));
    lua_rawseti(L, -2, ++index);
}
template <class T>
void append(lua_State* L, int& index, T value) requires std::is_integral_v<T>
{
    lua_pushnumber(L, static_cast<double>(value));
    lua_rawseti(L, -2, ++index);
}
void append(lua_State* L, int& index, const Vec3f& v)
{
    for (int k = 0; k < 3; ++k) append(L, index, v[k]);
}
void append(lua_State* L, int& index, const Quatf& q)
{
    for (const float number : {q.x(), q.y(), q.z(), q.w()}) append(L, index, number);
}

void append(lua_State* L, int& index, Token text)
{
    push_text(L, text.text());
    lua_rawseti(L, -2, ++index);
}

// Pushes { { name, numbers per value, flat numbers }, ... }.
void push_columns(lua_State* L, const PointSet& points)
{
    lua_newtable(L);
    int columns = 0;
    for (const auto& [name, any] : points.columns()) {
        lua_createtable(L, 3, 0);
        push_text(L, name);
        lua_rawseti(L, -2, 1);
        std::visit(
            [&](const auto& column) {
                using T = std::decay_t<decltype(column[0])>;
                lua_pushinteger(L, static_cast<lua_Integer>(components_of<T>));
                lua_rawseti(L, -2, 2);
                lua_newtable(L);
                int index = 0;
                for (std::size_t i = 0; i < column.size(); ++i) append(L, index, column[i]);
            },
            any);
        lua_rawseti(L, -2, 3);
        lua_rawseti(L, -2, ++columns);
    }
}

// Returns the study. lua/study.lua has checked that the fields exist and have the right types.
Study study_of(const Table& definition)
{
    const auto table = [&](const char* name) { return definition.named.at(name).table(); };
    const auto number = [](const Value& value) { return static_cast<std::int64_t>(*value.get<double>()); };
    Study study;
    study.name = *definition.named.at("name").get<std::string>();
    for (const auto& [knob, values] : table("sweep")->named) study.sweep[knob] = values.table()->list;
    for (const Value& line : table("lines")->list) study.lines.push_back(knob_text(line));
    study.first = number(table("frames")->list[0]);
    study.last = number(table("frames")->list[1]);
    if (definition.named.count("error")) study.error = *definition.named.at("error").get<std::string>();
    if (definition.named.count("error_frames"))
        study.last_frame_only = *definition.named.at("error_frames").get<std::string>() == "last";
    if (definition.named.count("reference")) study.reference = table("reference")->named;
    if (definition.named.count("repeat_runs"))
        study.repeat_runs = static_cast<int>(number(definition.named.at("repeat_runs")));
    study.complete();
    return study;
}

}  // namespace

Study Session::study() const
{
    State& state = host_->main();
    state.push_entry("study");
    state.call(0, 1);
    const Value definition = to_value(state, -1);
    lua_pop(state.lua(), 1);
    try {
        Study study = study_of(*definition.table());
        study.file = host_->graph.file;
        return study;
    } catch (Error& error) {
        throw error.at({host_->graph.file, 0});
    }
}

PointSet Session::study_reference(const Frame& frame, const Knobs& knobs) const
{
    State& state = host_->main();
    lua_State* L = state.lua();
    const Watchdog::Section section(host_->watchdog, fmt::format("{}: the study's reference", host_->graph.file));
    state.push_entry("reference");
    lua_pushnumber(L, frame.number);
    lua_pushnumber(L, frame.time);
    lua_pushnumber(L, frame.dt);
    push(state, knobs);
    state.call(4, 1);
    const Value found = to_value(state, -1);
    lua_pop(L, 1);
    try {
        if (!found.table())
            throw Error(
                fmt::format("the function returns {}; it must return {{ P = {{{{x, y, z}}, ...}} }}", describe(found)));
        const Maker& maker = find_maker("points.from");
        MakeContext context{host_->folder(), host_->warnings, false, {}, {}};
        const Table arguments{{}, {}, {{"columns", found}}};
        return std::dynamic_pointer_cast<const PointsObject>(maker.make(maker, arguments, context))->points;
    } catch (const Error& error) {
        throw Error(fmt::format("the study's reference, frame {:g}: {}", frame.number, error.what()), error.kind())
            .at({host_->graph.file, 0});
    }
}

double Session::study_error(const PointSet& points, const PointSet& reference) const
{
    State& state = host_->main();
    lua_State* L = state.lua();
    const Watchdog::Section section(host_->watchdog, fmt::format("{}: the study's error", host_->graph.file));
    state.push_entry("study_error");
    push_columns(L, points);
    push_columns(L, reference);
    state.call(2, 1);
    const double error = lua_tonumber(L, -1);
    lua_pop(L, 1);
    return error;
}

}  // namespace rapid
