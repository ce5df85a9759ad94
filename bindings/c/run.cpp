// Runs that write files, and the merge of their parts, in C.
#include <atomic>

#include "bindings/c/interface.h"
#include "include/rapid/merge.h"
#include "include/rapid/run.h"

namespace rapid {
namespace {

struct OpenRun {
    SceneRun run;
    RunOutcome outcome;
    std::string unwritten;
};
using Runs = Handles<OpenRun, 7>;

auto open_run(rapid_run* handle) { return open<Runs>(handle, "run"); }

void take_strings(std::vector<std::string>& to, const char* const* strings, std::size_t count, const char* name)
{
    if (count > 0) not_null(strings, name);
    for (std::size_t i = 0; i < count; ++i) to.emplace_back(&not_null(strings[i], name));
}

std::string text_or_none(const char* text) { return text ? text : ""; }

RunOptions run_options_of(const rapid_run_options& given)
{
    RunOptions options;
    if (given.text) options.text = given.text;
    if (given.frames) options.frames = RunFrames{given.frames->first, given.frames->last, given.frames->step};
    take_strings(options.files.outputs, given.outputs, given.output_count, "options->outputs");
    options.files.pictures = {{given.width, given.height}, camera_of(&given.camera)};
    options.statistics = text_or_none(given.statistics);
    options.profile = text_or_none(given.profile);
    options.events = text_or_none(given.events);
    options.cache = {text_or_none(given.cache), given.cache_every, given.cache_again != 0, given.cache_replace != 0};
    if (given.part != 0 || given.part_count != 0) options.part = RunPart{given.part, given.part_count};
    if (given.sample != 1) options.sample = given.sample;
    return options;
}

RunListener listener_of(const rapid_run_options& given)
{
    RunListener listener;
    void* const user = given.user;
    if (given.frame)
        listener.frame = [frame = given.frame, user](const RunFrame& done) {
            frame(user, done.number, done.points, done.seconds, done.is_known);
        };
    if (given.line) listener.line = [line = given.line, user](const std::string& text) { line(user, text.c_str()); };
    if (given.warning)
        listener.warning = [warning = given.warning, user](const std::string& text) { warning(user, text.c_str()); };
    return listener;
}

}  // namespace
}  // namespace rapid

using namespace rapid;

extern "C" {

int rapid_run_make(const char* file, const rapid_options* scene, const rapid_run_options* options, rapid_run** run,
                   rapid_error** error)
{
    return guarded(error, [&] {
        not_null(run, "run") = nullptr;
        const rapid_run_options usual = rapid_default_run_options();
        const rapid_run_options known = options ? known_part(options, "options", usual) : usual;
        SceneRun made =
            SceneRun::make(&not_null(file, "file"), options_of(scene), run_options_of(known), listener_of(known))
                .value();
        *run = static_cast<rapid_run*>(Runs::add(std::shared_ptr<OpenRun>(new OpenRun{std::move(made), {}, {}})));
    });
}

int rapid_run_prepare(rapid_run* run, rapid_error** error)
{
    return guarded(error, [&] { open_run(run)->run.prepare().value(); });
}

int64_t rapid_run_first_frame(rapid_run* run)
{
    return value_or_default([&] { return open_run(run)->run.first_frame(); });
}

int rapid_run_frames(rapid_run* run, rapid_frames* frames, rapid_error** error)
{
    return guarded(error, [&] {
        const RunFrames all = open_run(run)->run.frames();
        not_null(frames, "frames") = {all.first, all.last, all.step};
    });
}

int rapid_run_run(rapid_run* run, rapid_outcome* outcome, rapid_error** error)
{
    return guarded(error, [&] {
        const auto open = open_run(run);
        RunOutcome ended = open->run.run().value();
        open->outcome = std::move(ended);
        open->unwritten = joined(open->outcome.unwritten);
        const RunOutcome& of = open->outcome;
        if (outcome)
            store(outcome, {0, static_cast<int>(of.ending), of.last_frame, open->unwritten.c_str(), of.summary.c_str()},
                  "outcome");
        if (of.error) throw SceneException(*of.error);
    });
}

int rapid_run_end_after_frame(rapid_run* run, rapid_error** error)
{
    return guarded(error, [&] { open_run(run)->run.end_after_frame(); });
}

int rapid_run_cancel(rapid_run* run, rapid_error** error)
{
    return guarded(error, [&] { open_run(run)->run.cancel(); });
}

int rapid_run_release(rapid_run* run, rapid_error** error)
{
    return guarded(error, [&] {
        open_run(run);
        Runs::remove(run);
    });
}

int rapid_merge_files(const char* const* parts, size_t count, const char* output,
                      int (*progress)(void* user, int64_t frame, uint64_t points), void* user, rapid_merged* merged,
                      rapid_error** error)
{
    return guarded(error, [&] {
        std::vector<std::string> patterns;
        take_strings(patterns, parts, count, "parts");
        std::function<bool(std::int64_t, std::uint64_t)> callback;
        if (progress)
            callback = [&](std::int64_t frame, std::uint64_t points) { return progress(user, frame, points) != 0; };
        const MergedFiles all = merge_files(patterns, &not_null(output, "output"), callback).value();
        if (merged) store(merged, {0, all.parts, all.frames, all.points}, "merged");
    });
}

}  // extern "C"
