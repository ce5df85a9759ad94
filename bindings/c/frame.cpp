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
        give(column, column_in_c(find(open->frame, &not_null(name, "name")).value()), "column");
    });
}

const char* text_of(const rapid_error* error, const auto& field)
{
    const auto open = Errors::get(error);
    return open ? field(*open).c_str() : "";
}

}  // namespace

int tell(rapid_error** to, SceneError error) noexcept
{
    const int status = error.kind;
    if (to) try {
            auto object = std::make_shared<OpenError>();
            object->text = error.text();
            object->error = std::move(error);
            *to = static_cast<rapid_error*>(Errors::add(std::move(object)));
        } catch (...) {
            *to = nullptr;  // the status is all that can be told
        }
    return status;
}

rapid_frame* new_frame(SceneFrame frame)
{
    auto object = std::shared_ptr<OpenFrame>(new OpenFrame{std::move(frame), {}, {}, {}, {}, {}, {}, {}, {}});
    return static_cast<rapid_frame*>(Frames::add(std::move(object)));
}

}  // namespace rapid

using namespace rapid;

extern "C" {

const char* rapid_version(void) { return RAPID_VERSION; }

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
const char* rapid_error_stack(const rapid_error* error)
{
    return text_of(
        error, [](const OpenError& open) -> auto& { return open.error.script_stack; });
}
int rapid_error_line(const rapid_error* error)
{
    const auto open = Errors::get(error);
    return open ? open->error.line : 0;
}
int rapid_error_status(const rapid_error* error)
{
    const auto open = Errors::get(error);
    return open ? static_cast<int>(open->error.kind) : RAPID_OK;
}
void rapid_error_free(rapid_error* error) { Errors::remove(error); }

int rapid_frame_output(rapid_frame* of, const char* name, rapid_frame** frame, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(frame, "frame") = nullptr;
        *frame = new_frame(open_frame(of)->frame.output(&not_null(name, "name")).value());
    });
}

int rapid_frame_names(rapid_frame* frame, int what, const char** lines, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(lines, "lines") = nullptr;
        const auto open = open_frame(frame);
        if (what < RAPID_OUTPUTS || what > RAPID_WARNINGS)
            refuse(fmt::format(
                "what = {}; it must be one of RAPID_OUTPUTS, RAPID_COLUMNS, RAPID_GROUPS, RAPID_WARNINGS", what));
        const SceneFrame& of = open->frame;
        const auto names = what == RAPID_OUTPUTS   ? of.outputs()
                           : what == RAPID_COLUMNS ? of.columns()
                           : what == RAPID_GROUPS  ? of.groups()
                                                   : of.warnings();
        const std::lock_guard lock(open->mutex);
        if (open->names[what].empty()) open->names[what] = fmt::format("{}", fmt::join(names, "\n"));
        *lines = open->names[what].c_str();
    });
}

int rapid_frame_get_info(rapid_frame* frame, rapid_frame_info* info, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_frame(frame);
        const FrameStatisticsSummary all = open->frame.statistics();
        give(info,
             {0, open->frame.number(), open->frame.time(), open->frame.fps(), open->frame.size(), all.born, all.died,
              all.collisions, all.substeps, all.has_errors, all.error_p50, all.error_p95, all.error_max,
              all.penetration_max, all.constraint_residual_max, all.seconds, all.script_seconds, all.solve_seconds},
             "info");
    });
}

int rapid_frame_statistics(rapid_frame* frame, const char** json, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(json, "json") = nullptr;
        const auto open = open_frame(frame);
        const std::lock_guard lock(open->mutex);
        if (open->statistics.empty()) open->statistics = open->frame.statistics_json();
        *json = open->statistics.c_str();
    });
}

int rapid_frame_profile(rapid_frame* frame, const char** json, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(json, "json") = nullptr;
        const auto open = open_frame(frame);
        const std::lock_guard lock(open->mutex);
        if (open->profile.empty()) open->profile = open->frame.profile_json();
        *json = open->profile.c_str();
    });
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

int rapid_token_text(uint32_t token, const char** text, rapid_error** error)
{
    return guarded(error, [&] {
        not_null(text, "text") = nullptr;
        *text = SceneFrame::text_of(token).value().data();
    });
}

int rapid_text_token(const char* text, uint32_t* token, rapid_error** error)
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
        const std::string wanted = &not_null(name, "name");
        const std::map<std::string, SceneValue> details = open->frame.details();
        const auto found = details.find(wanted);
        if (found == details.end()) refuse(fmt::format("the frame has no detail value \"{}\"", wanted));
        not_null(value, "value") = value_in_c(found->second);  // a number or three: no text
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
    return guarded(error, [&] {
        not_null(json, "json") = nullptr;
        const auto open = open_frame(frame);
        SceneReport report = open->frame.describe().value();
        const std::lock_guard lock(open->mutex);
        open->description = std::move(report.json);
        *json = open->description.c_str();
    });
}

int rapid_frame_compare(rapid_frame* frame, rapid_frame* with, double tolerance, int* same, const char** json,
                        rapid_error** error)
{
    return guarded(error, [&] {
        if (json) *json = nullptr;
        const auto open = open_frame(frame);
        FrameComparison found = open->frame.compare(open_frame(with)->frame, tolerance).value();
        if (same) *same = found.same;
        const std::lock_guard lock(open->mutex);
        open->comparison = std::move(found.report.json);
        if (json) *json = open->comparison.c_str();
    });
}

int rapid_frame_release(rapid_frame* frame, rapid_error** error)
{
    return guarded(error, [&] {
        open_frame(frame);
        Frames::remove(frame);
    });
}

}  // extern "C"
