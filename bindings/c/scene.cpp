// Scenes in C.
#include <cmath>
#include <map>

#include "bindings/c/interface.h"
#include "runtime/base/json.h"

namespace rapid {
namespace {

std::vector<std::pair<std::string, SceneValue>> settings_of(const rapid_setting* settings, std::size_t count)
{
    std::vector<std::pair<std::string, SceneValue>> result;
    if (count > 0) not_null(settings, "settings");
    for (std::size_t i = 0; i < count; ++i) {
        const std::string name = &not_null(settings[i].name, "a setting's name");
        result.emplace_back(name, value_of(settings[i].value, name));
    }
    return result;
}

int open_into(rapid_scene** scene, rapid_error** error, const auto& open)
{
    return guarded(error, [&] {
        not_null(scene, "scene") = nullptr;
        auto object = std::shared_ptr<OpenScene>(new OpenScene{open().value(), false, {}, {}, {}, {}, {}});
        *scene = static_cast<rapid_scene*>(Scenes::add(std::move(object)));
    });
}

int advance_into(rapid_scene* scene, rapid_frame** frame, rapid_error** error, const auto& advance)
{
    return guarded(error, [&] {
        if (frame) *frame = nullptr;
        SceneFrame result = advance(SceneCall(scene).scene()).value();
        if (frame) *frame = new_frame(std::move(result));
    });
}

std::string in_json(const SceneNodeType& type)
{
    JsonText json;
    json.begin_object();
    json.members("name", type.name, "doc", type.doc);
    json.list("parameters", type.parameters, [&](const NodeParameter& parameter) {
        json.object("name", parameter.name, "type", parameter.type, "unit", parameter.unit, "doc", parameter.doc,
                    "default", parameter.fallback, "required", parameter.required);
    });
    json.end();
    return json.text();
}

}  // namespace

SceneOptions options_of(const rapid_options* given)
{
    const rapid_options known = given ? known_part(given, "options", rapid_default_options()) : rapid_default_options();
    SceneOptions options;
    options.set = settings_of(known.set, known.set_count);
    if (known.seed) options.seed = *known.seed;
    if (known.path_count > 0) not_null(known.paths, "options->paths");
    for (std::size_t i = 0; i < known.path_count; ++i)
        options.paths.emplace_back(&not_null(known.paths[i], "one of options->paths"));
    options.threads = known.threads;
    options.script_seconds = known.script_seconds;
    options.script_memory = known.script_memory;
    options.memory = known.memory;
    options.estimate_errors = known.estimate_errors != 0;
    options.keep_all = known.keep_all != 0;
    if (known.offers) {
        const auto offers = open_offers(known.offers);
        const std::lock_guard lock(offers->mutex);
        options.objects = offers->objects;
        options.nodes = offers->nodes;
        options.guard_callbacks = offers->guard;
    }
    void* const user = known.user;
    if (known.log)
        options.log = [log = known.log, user](LogLevel level, const std::string& text) {
            log(user, static_cast<int>(level), text.c_str());
        };
    if (known.progress)
        options.progress = [progress = known.progress, user](std::int64_t frame, std::int64_t last) {
            return progress(user, frame, last) != 0;
        };
    if (known.find_module)
        options.find_module = [find = known.find_module, user](const std::string& name) -> std::optional<std::string> {
            const char* text = find(user, name.c_str());
            return text ? std::optional<std::string>(text) : std::nullopt;
        };
    if (known.find_file)
        options.find_file = [find = known.find_file, user](const std::string& path) {
            const char* found = find(user, path.c_str());
            return std::string(found ? found : "");
        };
    return options;
}

rapid_value value_in_c(const SceneValue& value)
{
    rapid_value result{RAPID_NUMBER, {0, 0, 0}, nullptr};
    if (const auto* number = std::get_if<double>(&value)) {
        result.number[0] = *number;
    } else if (const auto* boolean = std::get_if<bool>(&value)) {
        result.type = RAPID_BOOLEAN;
        result.number[0] = *boolean;
    } else if (const auto* text = std::get_if<std::string>(&value)) {
        result.type = RAPID_TEXT;
        result.text = text->c_str();
    } else {
        result.type = RAPID_VEC3;
        std::copy_n(std::get<std::array<double, 3>>(value).begin(), 3, result.number);
    }
    return result;
}

SceneValue value_of(const rapid_value& value, const std::string& name)
{
    switch (value.type) {
        case RAPID_NUMBER:
            return value.number[0];
        case RAPID_BOOLEAN:
            return value.number[0] != 0;
        case RAPID_TEXT:
            return std::string(&not_null(value.text, "the text of a value"));
        case RAPID_VEC3:
            return std::array<double, 3>{value.number[0], value.number[1], value.number[2]};
        default:
            refuse(fmt::format(
                "{}: the type of its value is {}; it must be one of RAPID_NUMBER, RAPID_BOOLEAN, RAPID_TEXT, "
                "RAPID_VEC3",
                name, value.type));
    }
}

}  // namespace rapid

using namespace rapid;

extern "C" {

int rapid_scene_load_plugin(const char* file, rapid_error** error)
{
    return guarded(error, [&] { Scene::load_plugin(&not_null(file, "file")).value(); });
}

int rapid_scene_open(const char* file, const rapid_options* options, rapid_scene** scene, rapid_error** error)
{
    return open_into(scene, error, [&] { return Scene::open(&not_null(file, "file"), options_of(options)); });
}

int rapid_scene_open_text(const char* name, const char* text, const rapid_options* options, rapid_scene** scene,
                          rapid_error** error)
{
    return open_into(scene, error, [&] {
        return Scene::open_text(&not_null(name, "name"), &not_null(text, "text"), options_of(options));
    });
}

int rapid_scene_release(rapid_scene* scene, rapid_error** error)
{
    return guarded(error, [&] {
        open_scene(scene);
        Scenes::remove(scene);
    });
}

size_t rapid_scene_parameter_count(rapid_scene* scene)
{
    return value_or_default([&] { return SceneCall(scene).scene().parameters().size(); });
}

int rapid_scene_parameter(rapid_scene* scene, size_t index, rapid_parameter* parameter, rapid_error** error)
{
    return guarded(error, [&] {
        const SceneCall open(scene);
        const SceneParameter& found = at_index(open.scene().parameters(), index, "the scene has", "parameters");
        store(parameter,
              {0, found.name.c_str(), found.doc.c_str(), value_in_c(found.value), value_in_c(found.fallback)},
              "parameter");
    });
}

int rapid_scene_set(rapid_scene* scene, const rapid_setting* settings, size_t count, rapid_error** error)
{
    return guarded(error, [&] { SceneCall(scene).scene().set(settings_of(settings, count)).value(); });
}

size_t rapid_scene_node_count(rapid_scene* scene)
{
    return value_or_default([&] { return SceneCall(scene).scene().nodes().size(); });
}

int rapid_scene_node(rapid_scene* scene, size_t index, rapid_node* node, rapid_error** error)
{
    return guarded(error, [&] {
        const SceneCall open(scene);
        const SceneNode& found = at_index(open.scene().nodes(), index, "the scene has", "nodes");
        store(node, {0, found.name.c_str(), found.type.c_str(), found.file.c_str(), found.line}, "node");
    });
}

int rapid_scene_node_types(rapid_scene* scene, const char** json, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(json, "json") = nullptr;
        const SceneCall open(scene);
        std::vector<std::string> types;
        for (const SceneNodeType& type : open.scene().node_types().value()) types.push_back(in_json(type));
        open->node_types = fmt::format("[{}]", fmt::join(types, ","));
        *json = open->node_types.c_str();
    });
}

int rapid_scene_warnings(rapid_scene* scene, const char** text, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(text, "text") = nullptr;
        const SceneCall open(scene);
        open->warnings = joined(open.scene().warnings());
        *text = open->warnings.c_str();
    });
}

int rapid_scene_explain(rapid_scene* scene, const char** json, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(json, "json") = nullptr;
        const SceneCall open(scene);
        open->explanation = open.scene().explain().value().json;
        *json = open->explanation.c_str();
    });
}

int rapid_scene_points_after(rapid_scene* scene, const char* node, int64_t number, rapid_frame** frame,
                             rapid_error** error)
{
    return guarded(error, [&] {
        not_null(frame, "frame") = nullptr;
        *frame = new_frame(SceneCall(scene).scene().points_after(&not_null(node, "node"), number).value());
    });
}

int rapid_scene_graph(rapid_scene* scene, int form, const char** text, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(text, "text") = nullptr;
        const SceneCall open(scene);
        if (form < RAPID_GRAPH_DOT || form > RAPID_GRAPH_JSON)
            refuse(
                fmt::format("form = {}; it must be one of RAPID_GRAPH_DOT, RAPID_GRAPH_SVG, RAPID_GRAPH_JSON", form));
        open->graph = open.scene().graph(static_cast<GraphForm>(form)).value();
        *text = open->graph.c_str();
    });
}

int rapid_scene_trace(rapid_scene* scene, const int64_t* ids, size_t count, const char* create, int64_t first,
                      int64_t last, const char** json, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(json, "json") = nullptr;
        if (count > 0) not_null(ids, "ids");
        const SceneCall open(scene);
        TraceOptions options;
        options.ids.assign(ids, ids + count);
        if (create) options.create = create;
        options.first = first;
        options.last = last;
        SceneTrace trace = open.scene().trace(options).value();
        open->lives = std::move(trace.lives.json);
        *json = open->lives.c_str();
        if (trace.fault) throw SceneException(*trace.fault);
    });
}

int rapid_scene_offer(rapid_scene* scene, rapid_offers* offers, rapid_error** error)
{
    return guarded(error, [&] {
        const SceneCall open(scene);
        const auto given = open_offers(offers);
        const std::lock_guard lock(given->mutex);
        for (const auto& [name, object] : given->objects) open.scene().offer(name, object).value();
    });
}

double rapid_scene_fps(rapid_scene* scene)
{
    return value_or_default([&] { return SceneCall(scene).scene().fps(); });
}

int64_t rapid_scene_first_frame(rapid_scene* scene)
{
    return value_or_default([&] { return SceneCall(scene).scene().first_frame(); });
}

int64_t rapid_scene_next_frame(rapid_scene* scene)
{
    return value_or_default([&] { return SceneCall(scene).scene().next_frame(); });
}

int rapid_scene_advance(rapid_scene* scene, rapid_frame** frame, rapid_error** error)
{
    return advance_into(scene, frame, error, [](Scene& open) { return open.advance(); });
}

int rapid_scene_advance_to(rapid_scene* scene, int64_t number, rapid_frame** frame, rapid_error** error)
{
    return advance_into(scene, frame, error, [&](Scene& open) { return open.advance_to(number); });
}

int rapid_scene_restart(rapid_scene* scene, rapid_error** error)
{
    return guarded(error, [&] { SceneCall(scene).scene().restart().value(); });
}

int rapid_scene_cancel(rapid_scene* scene, rapid_error** error)
{
    return guarded(error, [&] { open_scene(scene)->scene.cancel(); });
}

int rapid_scene_save(rapid_scene* scene, rapid_snapshot** snapshot, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(snapshot, "snapshot") = nullptr;
        auto saved = std::make_shared<SceneSnapshot>(SceneCall(scene).scene().save().value());
        *snapshot = static_cast<rapid_snapshot*>(Snapshots::add(std::move(saved)));
    });
}

int rapid_scene_restore(rapid_scene* scene, rapid_snapshot* snapshot, rapid_error** error)
{
    return guarded(error, [&] { SceneCall(scene).scene().restore(*open_snapshot(snapshot)).value(); });
}

int64_t rapid_snapshot_frame(rapid_snapshot* snapshot)
{
    return value_or_default([&] { return open_snapshot(snapshot)->frame(); });
}

uint64_t rapid_snapshot_size(rapid_snapshot* snapshot)
{
    return value_or_default([&] { return std::uint64_t{open_snapshot(snapshot)->size()}; });
}

int rapid_snapshot_write(rapid_snapshot* snapshot, const char* path, rapid_error** error)
{
    return guarded(error, [&] { open_snapshot(snapshot)->write(&not_null(path, "path")).value(); });
}

int rapid_snapshot_read(const char* path, rapid_snapshot** snapshot, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(snapshot, "snapshot") = nullptr;
        auto read = std::make_shared<SceneSnapshot>(SceneSnapshot::read(&not_null(path, "path")).value());
        *snapshot = static_cast<rapid_snapshot*>(Snapshots::add(std::move(read)));
    });
}

int rapid_snapshot_release(rapid_snapshot* snapshot, rapid_error** error)
{
    return guarded(error, [&] {
        open_snapshot(snapshot);
        Snapshots::remove(snapshot);
    });
}

}  // extern "C"
