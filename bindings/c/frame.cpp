// Frames and errors in C.
#include <mutex>

#include "bindings/c/interface.h"

namespace rapid {
namespace {

rapid_column column_in_c(const SceneColumn& column)
{
    return {
        0,          column.name.data(), static_cast<int>(column.type), column.count, column.components, column.stride,
        column.data};
}

int column_into(rapid_frame* frame, const char* name, rapid_column* column, rapid_error** error, const auto& find)
{
    return guarded(error, [&] {
        const auto open = open_frame(frame);
        store(column, column_in_c(find(open->frame, &not_null(name, "name")).value()), "column");
    });
}

const char* text_of(const rapid_error* error, const auto& field)
{
    const auto open = Errors::get(error);
    return open ? field(*open).c_str() : "";
}

// Returns a text of the frame, which belongs to it until the next of its kind.
int text_into(rapid_frame* frame, const char* kind, const char** text, const char* name, rapid_error** error,
              const auto& make)
{
    return guarded(error, [&] {
        not_null(text, name) = nullptr;
        const auto open = open_frame(frame);
        std::string made = make(std::as_const(open->frame));
        const std::lock_guard lock(open->mutex);
        // A text returned before stays valid if it is the same.
        std::string& kept = open->strings[kind];
        if (kept != made) kept = std::move(made);
        *text = kept.c_str();
    });
}

int picture_into(rapid_frame* frame, const void** png, size_t* bytes, rapid_error** error, const auto& draw)
{
    return guarded(error, [&] {
        not_null(png, "png") = nullptr;
        not_null(bytes, "bytes") = 0;
        const auto open = open_frame(frame);
        std::string picture = draw(std::as_const(open->frame));
        const std::lock_guard lock(open->mutex);
        std::string& kept = open->strings["picture"];
        kept = std::move(picture);
        *png = kept.data();
        *bytes = kept.size();
    });
}

}  // namespace

int report_error(rapid_error** to, SceneError error) noexcept
{
    const int status = error.kind;
    if (to) try {
            auto object = std::make_shared<OpenError>();
            object->text = error.text();
            object->error = std::move(error);
            *to = static_cast<rapid_error*>(Errors::add(std::move(object)));
        } catch (...) {
            *to = nullptr;  // only the status can be returned
        }
    return status;
}

PictureCamera camera_of(const rapid_camera* given)
{
    PictureCamera camera;
    if (!given) return camera;
    const auto vector_of = [](const double* from) {
        std::array<double, 3> position{};
        std::copy_n(from, 3, position.begin());
        return position;
    };
    if (given->position) camera.position = vector_of(given->position);
    if (given->target) camera.target = vector_of(given->target);
    if (given->fov != 0) camera.fov = given->fov;
    return camera;
}

rapid_frame* new_frame(SceneFrame frame)
{
    auto object = std::shared_ptr<OpenFrame>(new OpenFrame{std::move(frame), {}, {}, {}});
    return static_cast<rapid_frame*>(Frames::add(std::move(object)));
}

}  // namespace rapid

using namespace rapid;

extern "C" {

const char* rapid_version(void) { return version().data(); }

const char* rapid_error_message(const rapid_error* error)
{
    return text_of(
        error, [](const OpenError& open) -> auto& { return open.error.message; });
}
const char* rapid_error_file(const rapid_error* error)
{
    return text_of(
        error, [](const OpenError& open) -> auto& { return open.error.file; });
}
const char* rapid_error_node(const rapid_error* error)
{
    return text_of(
        error, [](const OpenError& open) -> auto& { return open.error.node; });
}
const char* rapid_error_text(const rapid_error* error)
{
    return text_of(
        error, [](const OpenError& open) -> auto& { return open.text; });
}
const char* rapid_error_script_stack(const rapid_error* error)
{
    return text_of(
        error, [](const OpenError& open) -> auto& { return open.error.script_stack; });
}
int rapid_error_line(const rapid_error* error)
{
    const auto open = Errors::get(error);
    return open ? open->error.line : 0;
}
int rapid_error_kind(const rapid_error* error)
{
    const auto open = Errors::get(error);
    return open ? static_cast<int>(open->error.kind) : RAPID_OK;
}
void rapid_error_release(rapid_error* error) { Errors::remove(error); }

int rapid_frame_output(rapid_frame* of, const char* name, rapid_frame** frame, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(frame, "frame") = nullptr;
        *frame = new_frame(open_frame(of)->frame.output(&not_null(name, "name")).value());
    });
}

int rapid_frame_outputs(rapid_frame* frame, const char** lines, rapid_error** error)
{
    return text_into(frame, "outputs", lines, "lines", error, [](auto& of) { return joined(of.outputs()); });
}

int rapid_frame_columns(rapid_frame* frame, const char** lines, rapid_error** error)
{
    return text_into(frame, "columns", lines, "lines", error, [](auto& of) { return joined(of.columns()); });
}

int rapid_frame_groups(rapid_frame* frame, const char** lines, rapid_error** error)
{
    return text_into(frame, "groups", lines, "lines", error, [](auto& of) { return joined(of.groups()); });
}

int rapid_frame_details(rapid_frame* frame, const char** lines, rapid_error** error)
{
    return text_into(frame, "details", lines, "lines", error, [](auto& of) { return joined(of.details()); });
}

int rapid_frame_warnings(rapid_frame* frame, const char** lines, rapid_error** error)
{
    return text_into(frame, "warnings", lines, "lines", error, [](auto& of) { return joined(of.warnings()); });
}

int64_t rapid_frame_number(rapid_frame* frame)
{
    return value_or_default([&] { return open_frame(frame)->frame.number(); });
}
double rapid_frame_time(rapid_frame* frame)
{
    return value_or_default([&] { return open_frame(frame)->frame.time(); });
}
double rapid_frame_fps(rapid_frame* frame)
{
    return value_or_default([&] { return open_frame(frame)->frame.fps(); });
}
size_t rapid_frame_size(rapid_frame* frame)
{
    return value_or_default([&] { return open_frame(frame)->frame.size(); });
}

int rapid_frame_statistics(rapid_frame* frame, rapid_statistics* statistics, rapid_error** error)
{
    return guarded(error, [&] {
        const FrameStatisticsSummary all = open_frame(frame)->frame.statistics();
        store(statistics,
              {0, all.points, all.born, all.died, all.collisions, all.substeps, all.has_errors, all.error_p50,
               all.error_p95, all.error_max, all.penetration_max, all.constraint_residual_max, all.seconds,
               all.script_seconds, all.solve_seconds},
              "statistics");
    });
}

int rapid_frame_statistics_json(rapid_frame* frame, const char** json, rapid_error** error)
{
    return text_into(frame, "statistics", json, "json", error, [](auto& of) { return of.statistics_json(); });
}

int rapid_frame_profile_json(rapid_frame* frame, const char** json, rapid_error** error)
{
    return text_into(frame, "profile", json, "json", error, [](auto& of) { return of.profile_json(); });
}

int rapid_frame_column(rapid_frame* frame, const char* name, rapid_column* column, rapid_error** error)
{
    return column_into(frame, name, column, error, [](auto& of, const char* which) { return of.column(which); });
}

int rapid_frame_group(rapid_frame* frame, const char* name, rapid_column* column, rapid_error** error)
{
    return column_into(frame, name, column, error, [](auto& of, const char* which) { return of.group(which); });
}

int rapid_frame_expanded(rapid_frame* frame, const char* name, rapid_column* column, rapid_error** error)
{
    return column_into(frame, name, column, error, [](auto& of, const char* which) { return of.expanded(which); });
}

int rapid_frame_text_of(uint32_t token, const char** text, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(text, "text") = nullptr;
        *text = SceneFrame::text_of(token).value().data();
    });
}

int rapid_frame_token_of(const char* text, uint32_t* token, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(token, "token") = 0;
        *token = SceneFrame::token_of(&not_null(text, "text")).value();
    });
}

int rapid_frame_detail(rapid_frame* frame, const char* name, rapid_value* value, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_frame(frame);
        // a detail is one number or three, never a text
        not_null(value, "value") = value_in_c(open->frame.detail(&not_null(name, "name")).value());
    });
}

int rapid_frame_indices(rapid_frame* frame, const int64_t* ids, size_t count, uint32_t* indices, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_frame(frame);
        if (count == 0) return;
        not_null(ids, "ids");
        not_null(indices, "indices");
        const std::vector<std::uint32_t> found = open->frame.indices({ids, ids + count}).value();
        std::copy(found.begin(), found.end(), indices);
    });
}

int rapid_frame_write(rapid_frame* frame, const char* path, rapid_error** error)
{
    return guarded(error, [&] { open_frame(frame)->frame.write(&not_null(path, "path")).value(); });
}

int rapid_frame_read(const char* path, rapid_frame** frame, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(frame, "frame") = nullptr;
        *frame = new_frame(SceneFrame::read(&not_null(path, "path")).value());
    });
}

int rapid_frame_describe(rapid_frame* frame, const char** json, rapid_error** error)
{
    return text_into(frame, "description", json, "json", error, [](auto& of) { return of.describe().value().json; });
}

int rapid_frame_compare(rapid_frame* frame, rapid_frame* with, double tolerance, int* same, const char** json,
                        rapid_error** error)
{
    const char* unread = nullptr;
    return text_into(frame, "comparison", json ? json : &unread, "json", error, [&](auto& of) {
        FrameComparison found = of.compare(open_frame(with)->frame, tolerance).value();
        if (same) *same = found.same;
        return std::move(found.report.json);
    });
}

int rapid_frame_picture(rapid_frame* frame, rapid_shapes* shapes, const rapid_camera* camera, int width, int height,
                        const void** png, size_t* bytes, rapid_error** error)
{
    return picture_into(frame, png, bytes, error, [&](auto& of) {
        return of.picture(open_shapes(shapes)->shapes, camera_of(camera), {width, height}).value();
    });
}

int rapid_scene_picture(rapid_scene* scene, rapid_frame* frame, int width, int height, const void** png, size_t* bytes,
                        rapid_error** error)
{
    return picture_into(frame, png, bytes, error, [&](auto& of) {
        return SceneCall(scene).scene().picture(of, {width, height}).value();
    });
}

int rapid_frame_release(rapid_frame* frame, rapid_error** error)
{
    return guarded(error, [&] {
        open_frame(frame);
        Frames::remove(frame);
    });
}

int rapid_scene_shapes(rapid_scene* scene, int64_t number, rapid_shapes** shapes, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(shapes, "shapes") = nullptr;
        auto object = std::make_shared<OpenShapes>();
        object->shapes = SceneCall(scene).scene().shapes(number).value();
        object->meshes = object->shapes.meshes();
        object->planes = object->shapes.planes();
        object->warnings = joined(object->shapes.warnings());
        *shapes = static_cast<rapid_shapes*>(AllShapes::add(std::move(object)));
    });
}

size_t rapid_shapes_mesh_count(rapid_shapes* shapes)
{
    return value_or_default([&] { return open_shapes(shapes)->meshes.size(); });
}

int rapid_shapes_mesh(rapid_shapes* shapes, size_t index, rapid_mesh* mesh, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_shapes(shapes);
        const ShapeMesh& found = at_index(open->meshes, index, "the shapes have", "meshes");
        store(mesh,
              {0, static_cast<int>(found.role), found.corner_count, found.positions, found.triangle_count,
               found.triangles},
              "mesh");
    });
}

size_t rapid_shapes_plane_count(rapid_shapes* shapes)
{
    return value_or_default([&] { return open_shapes(shapes)->planes.size(); });
}

int rapid_shapes_plane(rapid_shapes* shapes, size_t index, rapid_plane* plane, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_shapes(shapes);
        const ShapePlane& found = at_index(open->planes, index, "the shapes have", "planes");
        store(plane, {0, {found.normal[0], found.normal[1], found.normal[2]}, found.offset}, "plane");
    });
}

int rapid_shapes_has_camera(rapid_shapes* shapes)
{
    return value_or_default([&] { return static_cast<int>(open_shapes(shapes)->shapes.has_camera()); });
}

int rapid_shapes_warnings(rapid_shapes* shapes, const char** lines, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(lines, "lines") = nullptr;
        *lines = open_shapes(shapes)->warnings.c_str();
    });
}

int rapid_shapes_release(rapid_shapes* shapes, rapid_error** error)
{
    return guarded(error, [&] {
        open_shapes(shapes);
        AllShapes::remove(shapes);
    });
}

}  // extern "C"
