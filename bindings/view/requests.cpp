#include "bindings/view/requests.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "bindings/scene/scene_inside.h"
#include "bindings/view/frame_message.h"
#include "include/rapid/scene.h"
#include "runtime/base/error.h"
#include "runtime/base/json.h"
#include "runtime/solver/figure_table.h"

namespace rapid {

// Reads the fields of a page's request, each checked against its type and its range. All functions throw if a field has
// another type, or a value that is refused; the error names a valid value.

// colour, group, velocities, most.
FrameOptions frame_options_of(const CheckedJson& request);

namespace {

constexpr int max_depth = 8;  // of lists: copying deeper ones would overflow the stack
constexpr int min_edge = 16, max_edge = 16384;

int edge_of(const CheckedJson& request, const char* name, int usual)
{
    const int edge = request.value(name, usual);
    if (edge < min_edge || edge > max_edge)
        throw Error(fmt::format("{} = {}; it must be from {} to {} pixels", name, edge, min_edge, max_edge));
    return edge;
}

}  // namespace

// Lists and objects nested deeper than eight levels are skipped. Throws Error unless the message is a JSON object.
CheckedJson parse_request(const std::string& message)
{
    const auto is_shallow = [](int depth, CheckedJson::parse_event_t, CheckedJson&) { return depth <= max_depth; };
    CheckedJson request = CheckedJson::parse(message, is_shallow, false);
    if (!request.is_object()) throw Error("a request must be a JSON object");
    return request;
}

// A frame that can be computed: one from first to last.
std::int64_t frame_of(const CheckedJson& request, const char* name, std::int64_t first, std::int64_t last)
{
    const auto frame = request.at(name).get<std::int64_t>();
    if (frame < first || frame > last)
        throw Error(fmt::format("{} = {}; it must be a frame from {} to {}", name, frame, first, last));
    return frame;
}

// width and height, from 16 to 16384 pixels.
PictureSize size_of(const CheckedJson& request)
{
    return {edge_of(request, "width", 1280), edge_of(request, "height", 720)};
}

// camera: position, target, vertical angle in degrees. Without one, the camera is fitted.
PictureCamera camera_of(const CheckedJson& request)
{
    if (!request.contains("camera")) return {};
    const auto camera = request["camera"].get<std::vector<double>>();
    if (camera.size() != 7)
        throw Error(fmt::format("camera has {} numbers; it must have 7: position, target, angle", camera.size()));
    return {std::array{camera[0], camera[1], camera[2]}, std::array{camera[3], camera[4], camera[5]}, camera[6]};
}

FrameOptions frame_options_of(const CheckedJson& request)
{
    FrameOptions frame_options;
    frame_options.colour = request.value("colour", "");
    frame_options.group = request.value("group", "");
    frame_options.velocities = request.value("velocities", false);
    frame_options.most = request.value("most", frame_options.most);
    return frame_options;
}

namespace {

using Json = CheckedJson;

constexpr std::size_t max_rows = 500;          // of the spreadsheet, per request
constexpr std::size_t max_figures = 500;       // frames, per request
constexpr std::size_t max_segments = 480'000;  // of trails
constexpr std::size_t max_waiting = 1000;      // requests; a page has one

// Returns the figures that the page draws.
const std::string& charts()
{
    static const std::string text = [] {
        Json list = Json::array();
#define RAPID_FIGURE(type, name, together, later, callback, unit, meaning, chart, ...) \
    if (*chart) list.push_back({{"key", #name}, {"title", chart}, {"unit", unit}});
        RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
        return json_text(list);
    }();
    return text;
}

Json json_of(const SceneValue& value)
{
    return std::visit([](const auto& known) { return Json(known); }, value);
}

Json json_of(const Error& error)
{
    return {{"message", error.message()},
            {"text", error.what()},
            {"file", error.location().file},
            {"line", error.location().line},
            {"node", error.node()}};
}

const char* name_of(ViewState state)
{
    switch (state) {
        case ViewState::Starting:
            return "starting";
        case ViewState::Computing:
            return "computing";
        case ViewState::Done:
            return "done";
        case ViewState::Full:
            return "full";
        case ViewState::Failed:
            return "failed";
    }
    return "";
}

// JSON has no infinities or NaN: they are sent as strings.
Json number(double value)
{
    if (std::isfinite(value)) return value;
    return std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf";
}

Json value_at(const SceneColumn& column, std::size_t i)
{
    switch (column.type) {
        case ColumnType::Float:
            return number(*column.at<float>(i));
        case ColumnType::Vec3:
        case ColumnType::Quat: {
            Json components = Json::array();
            for (std::size_t k = 0; k < column.components; ++k) components.push_back(number(column.at<float>(i)[k]));
            return components;
        }
        case ColumnType::Int32:
            return *column.at<std::int32_t>(i);
        case ColumnType::Int64:
            return *column.at<std::int64_t>(i);
        case ColumnType::UInt8:
            return *column.at<std::uint8_t>(i);
        case ColumnType::String:
            return std::string(SceneFrame::text_of(*column.at<std::uint32_t>(i)).value());
    }
    return nullptr;
}

Json row_of(const SceneFrame& points, std::size_t i)
{
    Json row = Json::object();
    for (const std::string& name : points.columns())
        if (name != "dt") row[name] = value_at(*points.column(name), i);
    Json groups = Json::array();
    for (const std::string& name : points.groups())
        if (*points.group(name)->at<std::uint8_t>(i)) groups.push_back(name);
    return {{"values", row}, {"groups", groups}};
}

std::uint32_t index_of(const SceneFrame& points, std::int64_t id) { return points.indices({id}).value().front(); }

Eigen::Map<const Eigen::Vector3f> vector_at(const SceneColumn& column, std::size_t i)
{
    return Eigen::Map<const Eigen::Vector3f>(column.at<float>(i));
}

// Returns a frame of the request, checked against the run's range.
std::int64_t computable_frame(const ViewSimulation& simulation, const Json& json, const char* name)
{
    const ViewStatus status = simulation.status();
    return frame_of(json, name, status.first, status.last);
}

// Returns the output that a request names, or the first one if it names none.
Result<SceneFrame> chosen_output(const ViewFrame& frame, const Json& json)
{
    return frame.points.output(json.value("output", frame.points.outputs().front()));
}

// Returns the camera as the page sends one: position, target, angle in degrees. Null if the scene has none.
Json camera_of_scene(const ViewFrame& frame, const Json& json)
{
    const Result<SceneFrame> points = chosen_output(frame, json);
    if (!frame.shapes.has_camera() || !points) return nullptr;
    const PictureCamera camera = SceneInside::camera(*points, frame.shapes, {}, size_of(json)).value();
    const auto &from = *camera.position, &to = *camera.target;
    return {from[0], from[1], from[2], to[0], to[1], to[2], *camera.fov};
}

}  // namespace

void ViewRequests::PendingRequest::reply(Json json) const
{
    json["re"] = re;
    answer(json_text(json), false);
}

void ViewRequests::PendingRequest::send(const std::string& data) const
{
    std::string message(8, '\0');
    const std::uint32_t words[2] = {re, 0};
    std::memcpy(message.data(), words, sizeof words);
    answer(message + data, true);
}

void ViewRequests::PendingRequest::fail(const std::string& why) const { reply({{"error", why}}); }

ViewRequests::ViewRequests(ViewSimulation& simulation, std::string title,
                           std::function<void(std::function<void()>)> post)
    : simulation_(simulation), title_(std::move(title)), post_(std::move(post))
{
}

// Also answers a request without a usable number, with "re" null.
void ViewRequests::handle(const std::string& message, const Answer& answer)
{
    try {
        const Json json = parse_request(message);
        const PendingRequest request{json.at("re").get<std::uint32_t>(), answer};
        request.guard([&] { dispatch(json, request); });
    } catch (const std::exception& error) {
        answer(json_text(Json({{"re", nullptr}, {"error", error.what()}})), false);
    }
}

template <class F>
void ViewRequests::PendingRequest::guard(const F& answer_it) const
{
    try {
        answer_it();
    } catch (const std::exception& error) {
        fail(error.what());
    }
}

template <class F>
void ViewRequests::answer_later(const PendingRequest& request, F answer)
{
    post_([request, answer = std::move(answer)] { request.guard(answer); });
}

void ViewRequests::dispatch(const Json& json, const PendingRequest& request)
{
    const std::string what = json.value("do", "");
    if (what == "status") {
        const std::uint64_t since = json.value("since", std::uint64_t{0});
        const std::uint64_t graph = json.value("graph", std::uint64_t{0});
        if (simulation_.status().version > since) return send_status(request, graph);
        if (waiting_.size() == max_waiting) {
            waiting_.front().request.fail("too many requests are waiting for a change");
            waiting_.erase(waiting_.begin());
        }
        waiting_.push_back({since, graph, request});
    } else if (what == "frame") {
        send_frame(json, request);
    } else if (what == "shapes") {
        send_shapes(json, request);
    } else if (what == "point") {
        send_point(json, request);
    } else if (what == "path") {
        send_path(json, request);
    } else if (what == "trails") {
        send_trails(json, request);
    } else if (what == "trace") {
        send_trace(json, request);
    } else if (what == "sheet") {
        send_sheet(json, request);
    } else if (what == "region") {
        send_region(json, request);
    } else if (what == "figures") {
        send_figures(json, request);
    } else if (what == "arguments") {
        send_arguments(json, request);
    } else if (what == "picture") {
        send_picture(json, request);
    } else if (what == "film") {
        begin_film(json, request);
    } else if (what == "film_progress") {
        send_film_progress(request);
    } else if (what == "film_data") {
        send_film(request);
    } else if (what == "film_cancel") {
        film_.reset();
        request.reply(Json::object());
    } else if (what == "set") {
        set_parameters(json, request);
    } else {
        request.fail(fmt::format("there is no request \"{}\"", what));
    }
}

void ViewRequests::answer_waiting()
{
    const std::uint64_t version = simulation_.status().version;
    std::erase_if(waiting_, [&](const auto& waiting) {
        if (version <= waiting.since) return false;
        send_status(waiting.request, waiting.graph);
        return true;
    });
}

void ViewRequests::send_status(const PendingRequest& request, std::uint64_t graph) const
{
    const ViewStatus status = simulation_.status();
    const FrameStore::Stretches stretches =
        simulation_.is_sequence() ? FrameStore::Stretches{} : simulation_.store().stretches(status.run);
    Json parameters = Json::array(), warnings = Json::array();
    const std::map<std::string, std::string> values = simulation_.values();
    for (const SceneParameter& parameter : status.parameters)
        parameters.push_back({{"name", parameter.name},
                              {"doc", parameter.doc},
                              {"value", json_of(parameter.value)},
                              {"default", json_of(parameter.fallback)},
                              {"set", values.contains(parameter.name)}});
    for (const auto& [frame, text] : status.warnings) warnings.push_back({{"frame", frame}, {"text", text}});
    Json json = {{"version", status.version},
                 {"title", title_},
                 {"sequence", simulation_.is_sequence()},
                 {"run", status.run},
                 {"state", name_of(status.state)},
                 {"first", status.first},
                 {"last", status.last},
                 {"fps", status.fps},
                 {"ready", stretches.fresh},
                 {"stale", stretches.stale},
                 {"bytes", simulation_.store().bytes()},
                 {"most_bytes", simulation_.store().most_bytes()},
                 {"parameters", parameters},
                 {"values", values},
                 {"warnings", warnings},
                 {"more_warnings", status.more_warnings},
                 {"outputs", status.outputs},
                 {"names", status.names},
                 {"ending", simulation_.ending()},
                 {"films", !simulation_.options().is_confined},
                 {"no_graph", status.no_graph}};
    json["graph_number"] = status.graph_number;
    if (status.graph_number != graph && status.graph) json["graph"] = Json::parse(*status.graph);
    json["error"] = status.error ? json_of(*status.error) : Json();
    if (simulation_.is_sequence()) json["ready"] = {{status.first, status.last}};
    request.reply(std::move(json));
}

void ViewRequests::with_points(const Json& json, const PendingRequest& request, const WithPoints& use)
{
    const std::string node = json.value("after", "");
    if (!node.empty()) {
        simulation_.inspect(computable_frame(simulation_, json, "frame"),
                            [=, this](const ViewSimulation::Results& all, const std::string& error) {
                                answer_later(request, [=] {
                                    if (!error.empty()) return request.fail(error);
                                    const auto points = all.find(node);
                                    if (points == all.end())
                                        return request.fail("the node is not evaluated in this frame");
                                    use(points->second);
                                });
                            });
        return;
    }
    const ViewFramePtr frame = simulation_.frame(json.at("frame").get<std::int64_t>());
    if (!frame) return request.fail("the frame is not computed");
    const Result<SceneFrame> points = chosen_output(*frame, json);
    if (!points) return request.fail("the scene has no output of this name");
    use(*points);
}

void ViewRequests::send_frame(const Json& json, const PendingRequest& request)
{
    const std::int64_t number = json.at("frame").get<std::int64_t>();
    const std::string after = json.value("after", "");
    const ViewFramePtr frame = after.empty() ? simulation_.frame(number) : nullptr;
    const Json head = {{"frame", number}, {"run", frame ? frame->run : simulation_.status().run}, {"after", after}};
    with_points(json, request, [=, frame_options = frame_options_of(json)](const SceneFrame& points) {
        request.answer(frame_message(request.re, points, frame_options, head), true);
    });
}

std::uint64_t ViewRequests::number_of(const ShapeMesh& mesh)
{
    const auto known = meshes_.find(mesh.owner);
    if (known != meshes_.end()) return known->second;
    std::erase_if(meshes_, [](const auto& entry) { return entry.first.expired(); });
    meshes_[mesh.owner] = next_mesh_;
    return next_mesh_++;
}

void ViewRequests::send_shapes(const Json& json, const PendingRequest& request)
{
    const ViewFramePtr frame = simulation_.frame(json.at("frame").get<std::int64_t>());
    if (!frame) return request.fail("the frame is not computed");
    std::vector<std::uint64_t> numbers;
    for (const ShapeMesh& mesh : frame->shapes.meshes()) numbers.push_back(number_of(mesh));
    const auto known = json.value("known", std::vector<std::uint64_t>());
    const Json head = {{"camera", camera_of_scene(*frame, json)}};
    request.answer(shapes_message(request.re, frame->shapes, {known.begin(), known.end()}, numbers, head), true);
}

void ViewRequests::send_point(const Json& json, const PendingRequest& request)
{
    with_points(json, request, [=, frame_options = frame_options_of(json)](const SceneFrame& points) {
        std::size_t i = points.size();
        if (json.contains("id")) {
            i = index_of(points, json["id"].get<std::int64_t>());
        } else {
            const ShownPoints shown = shown_points(points, frame_options);
            const auto k = json.at("row").get<std::size_t>();
            if (k < shown.count) i = shown[k];
        }
        if (i >= points.size()) return request.fail("the point is not in this frame");
        request.reply(row_of(points, i));
    });
}

// Sends a point's path: its positions in all frames in memory, with speed, error and substeps.
void ViewRequests::send_path(const Json& json, const PendingRequest& request) const
{
    const auto id = json.at("id").get<std::int64_t>();
    Json path = Json::array();
    for (const ViewFramePtr& frame : simulation_.store().frames_of_run(simulation_.status().run)) {
        const Result<SceneFrame> points = chosen_output(*frame, json);
        if (!points) continue;
        const std::uint32_t i = index_of(*points, id);
        if (i == SceneFrame::no_index) continue;
        const auto P = vector_at(*points->column("P"), i);
        const auto error = find_column(*points, "error", ColumnType::Float);
        const auto substeps = find_column(*points, "substeps", ColumnType::Int32);
        path.push_back({frame->number, number(P.x()), number(P.y()), number(P.z()),
                        number(vector_at(*points->column("v"), i).norm()), error ? value_at(*error, i) : Json(),
                        substeps ? value_at(*substeps, i) : Json()});
    }
    request.reply({{"path", path}});
}

// Sends the previous positions of a frame's points as line segments; if there are many points, every nth by id.
void ViewRequests::send_trails(const Json& json, const PendingRequest& request)
{
    const std::int64_t last = computable_frame(simulation_, json, "frame");
    const std::int64_t first = last - std::clamp<std::int64_t>(json.value("frames", std::int64_t{12}), 1, 1000);
    FrameOptions frame_options = frame_options_of(json);
    frame_options.most = std::min<std::size_t>(20000, max_segments / static_cast<std::size_t>(last - first));
    with_points(json, request, [=, this](const SceneFrame& now) {
        const ShownPoints shown = shown_points(now, frame_options);
        const SceneColumn P_now = *now.column("P"), id = *now.column("id");
        std::vector<Eigen::Vector3f> there(shown.count);
        std::vector<std::int64_t> ids(shown.count);
        for (std::size_t k = 0; k < shown.count; ++k) {
            there[k] = vector_at(P_now, shown[k]);
            ids[k] = *id.at<std::int64_t>(shown[k]);
        }
        std::vector<std::uint8_t> was(shown.count, 1);
        std::vector<float> segments;
        for (std::int64_t number = last - 1; number >= first; --number) {
            const ViewFramePtr frame = simulation_.store().find(number);
            if (!frame) break;
            const Result<SceneFrame> points = chosen_output(*frame, json);
            if (!points) break;
            const std::vector<std::uint32_t> indices = points->indices(ids).value();
            const SceneColumn P = *points->column("P");
            const auto age = static_cast<float>(last - number) / static_cast<float>(last - first);
            for (std::size_t k = 0; k < shown.count; ++k) {
                was[k] = was[k] && indices[k] != SceneFrame::no_index;
                if (!was[k]) continue;
                const Eigen::Vector3f before = vector_at(P, indices[k]);
                for (const Eigen::Vector3f& end : {there[k], before})
                    segments.insert(segments.end(), {end.x(), end.y(), end.z(), age});
                there[k] = before;
            }
        }
        request.answer(trails_message(request.re, segments, shown.every), true);
    });
}

void ViewRequests::send_trace(const Json& json, const PendingRequest& request)
{
    const std::int64_t last = computable_frame(simulation_, json, "last");
    const auto reply = [=, this](const std::string& lives, const std::string& error) {
        answer_later(request, [=] {
            if (!error.empty()) return request.fail(error);
            request.reply({{"lives", Json::parse(lives)}});
        });
    };
    simulation_.origin(computable_frame(simulation_, json, "frame"), json.value("output", "main"),
                       json.at("id").get<std::int64_t>(),
                       [=, this](const PointOrigin& point, const std::string& unknown) {
                           answer_later(request, [=, this] {
                               if (!unknown.empty()) return request.fail(unknown);
                               simulation_.trace(point, last, reply);
                           });
                       });
}

void ViewRequests::send_sheet(const Json& json, const PendingRequest& request)
{
    with_points(json, request, [=, frame_options = frame_options_of(json)](const SceneFrame& points) {
        FrameOptions all = frame_options;
        all.most = points.size();
        const ShownPoints shown = shown_points(points, all);
        std::vector<std::uint32_t> order(shown.count);
        for (std::size_t k = 0; k < shown.count; ++k) order[k] = static_cast<std::uint32_t>(shown[k]);
        const std::string sort = json.value("sort", "id");
        const bool down = json.value("descending", false);
        if (sort == "id") {
            const SceneColumn column = *points.column("id");
            const auto id = [&](std::uint32_t i) { return *column.at<std::int64_t>(i); };
            std::stable_sort(order.begin(), order.end(),
                             [&](auto a, auto b) { return down ? id(a) > id(b) : id(a) < id(b); });
        } else {
            const std::vector<float> values = numbers_of(points, sort);
            const auto is_before = [down](float a, float b) {  // points without a value are last
                return std::isnan(b) ? !std::isnan(a) : down ? a > b : a < b;
            };
            std::stable_sort(order.begin(), order.end(),
                             [&](auto a, auto b) { return is_before(values[a], values[b]); });
        }
        const std::size_t from = std::min(json.value("from", std::size_t{0}), order.size());
        const std::size_t to = std::min(order.size(), from + std::min(json.value("count", max_rows), max_rows));
        Json names = Json::array(), rows = Json::array();
        for (const std::string& name : points.columns())
            if (name != "dt") names.push_back(name);
        for (std::size_t k = from; k < to; ++k) rows.push_back(row_of(points, order[k]));
        request.reply(
            {{"total", order.size()}, {"from", from}, {"names", names}, {"groups", points.groups()}, {"rows", rows}});
    });
}

// Sends the number of points whose projection is within a rectangle of the screen, and the ranges of their attributes.
// matrix: from the world to the screen's -1 ... 1, by columns.
void ViewRequests::send_region(const Json& json, const PendingRequest& request)
{
    with_points(json, request, [=, frame_options = frame_options_of(json)](const SceneFrame& points) {
        const auto matrix = json.at("matrix").get<std::vector<double>>();
        const auto rectangle = json.at("rectangle").get<std::vector<double>>();  // smallest x, y, largest x, y
        if (matrix.size() != 16 || rectangle.size() != 4) return request.fail("a matrix has 16 numbers, a rectangle 4");
        const Eigen::Map<const Eigen::Matrix4d> project(matrix.data());
        FrameOptions all = frame_options;
        all.most = points.size();
        const ShownPoints shown = shown_points(points, all);
        const SceneColumn P = *points.column("P");
        Indices indices;
        for (std::size_t k = 0; k < shown.count; ++k) {
            const Eigen::Vector4d at = project * vector_at(P, shown[k]).cast<double>().homogeneous();
            if (at.w() <= 0) continue;
            const double x = at.x() / at.w(), y = at.y() / at.w();
            if (x >= rectangle[0] && x <= rectangle[2] && y >= rectangle[1] && y <= rectangle[3])
                indices.push_back(static_cast<std::uint32_t>(shown[k]));
        }
        Json ranges = Json::object(), groups = Json::object();
        const auto add = [&](const std::string& name) {
            const std::vector<float> values = numbers_of(points, name, &indices);
            float low = std::numeric_limits<float>::infinity(), high = -low;
            double sum = 0;
            for (const float value : values) low = std::min(low, value), high = std::max(high, value), sum += value;
            if (!values.empty())
                ranges[name] = {number(low), number(sum / static_cast<double>(values.size())), number(high)};
        };
        add("speed");
        for (const std::string& name : points.columns())
            if (name != "dt" && name != "speed") add(name);
        for (const std::string& name : points.groups()) {
            const SceneColumn members = *points.group(name);
            groups[name] = std::count_if(indices.begin(), indices.end(),
                                         [&](std::uint32_t i) { return *members.at<std::uint8_t>(i) != 0; });
        }
        request.reply({{"count", indices.size()}, {"ranges", ranges}, {"groups", groups}});
    });
}

void ViewRequests::send_figures(const Json& json, const PendingRequest& request) const
{
    const std::int64_t after = json.value("after", std::int64_t{INT64_MIN});
    const std::uint64_t run = simulation_.status().run;
    const std::vector<std::string> all = simulation_.store().statistics(run, after, max_figures);
    // The texts are forwarded unchanged: parsing and writing them again took ten times as long.
    JsonText answer;
    answer.object(
        "re", request.re, "run", run, "figures",
        [&] {
            answer.begin_list();
            for (const std::string& figures : all) answer.written(figures);
            answer.end();
        },
        "more", all.size() == max_figures, "charts", [&] { answer.written(charts()); });
    request.answer(answer.text(), false);
}

void ViewRequests::send_arguments(const Json& json, const PendingRequest& request)
{
    simulation_.arguments(computable_frame(simulation_, json, "frame"),
                          [=, this](const ViewSimulation::Arguments& arguments, const std::string& error) {
                              answer_later(request, [=] {
                                  if (!error.empty()) return request.fail(error);
                                  request.reply({{"arguments", arguments}});
                              });
                          });
}

void ViewRequests::send_picture(const Json& json, const PendingRequest& request)
{
    const ViewFramePtr frame = simulation_.frame(json.at("frame").get<std::int64_t>());
    if (!frame) return request.fail("the frame is not computed");
    with_points(json, request, [=](const SceneFrame& points) {
        request.send(points.picture(frame->shapes, camera_of(json), size_of(json)).value());
    });
}

void ViewRequests::begin_film(const Json& json, const PendingRequest& request)
{
    if (simulation_.options().is_confined)
        return request.fail(
            "films need the program ffmpeg, which --untrusted does not allow; save pictures of frames (.png)");
    const ViewStatus status = simulation_.status();
    ViewFilm::Settings settings;
    settings.extension = json.value("extension", "");
    settings.first = computable_frame(simulation_, json, "first");
    settings.last = computable_frame(simulation_, json, "last");
    settings.output = json.value("output", "main");
    settings.film = {json.value("fps", status.fps), size_of(json), camera_of(json)};
    settings.threads = simulation_.options().threads;
    auto film = std::make_unique<ViewFilm>(std::move(settings),
                                           [this](std::int64_t number) { return simulation_.frame(number); });
    film_ = std::move(film);  // a film in progress is abandoned
    send_film_progress(request);
}

void ViewRequests::send_film_progress(const PendingRequest& request) const
{
    if (!film_) return request.fail("no film is being made");
    const ViewFilm::Progress progress = film_->progress();
    if (!progress.error.empty()) return request.fail(progress.error);
    request.reply({{"done", progress.done}, {"of", progress.of}, {"ended", progress.has_ended}});
}

void ViewRequests::send_film(const PendingRequest& request)
{
    if (!film_ || !film_->progress().has_ended) return request.fail("no film is ready");
    std::string film = film_->take();
    if (film.empty()) return request.fail("no film is ready");
    film_.reset();
    request.send(film);
}

void ViewRequests::set_parameters(const Json& json, const PendingRequest& request)
{
    std::map<std::string, std::string> values;
    for (const auto& [name, value] : json.at("values").items()) {
        if (value.is_array()) {
            std::vector<std::string> parts;
            for (const Json& part : value) parts.push_back(json_text(part));
            values[name] = fmt::format("{}", fmt::join(parts, ","));
        } else {
            values[name] = value.is_string() ? value.get<std::string>() : json_text(value);
        }
    }
    simulation_.set(std::move(values));
    request.reply({{"run", simulation_.status().run}});
}

}  // namespace rapid
