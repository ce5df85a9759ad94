// Runs that write files: a scene, the files of its frames, and their cache.
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <filesystem>
#include <mutex>

#include "bindings/run/event_file.h"
#include "bindings/run/part_record.h"
#include "bindings/run/run_cache.h"
#include "bindings/run/run_report.h"
#include "bindings/run/written_names.h"
#include "bindings/scene/run_outputs.h"
#include "bindings/scene/scene_impl.h"
#include "runtime/base/setting_names.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/graph/coupling.h"
#include "runtime/graph/error_sources.h"

namespace rapid {
namespace {

constexpr std::int64_t default_frames = 48;

std::string name_of(const RunPart& part) { return part_name(part.number, part.count); }

std::string name_in_part(const std::string& file, const std::optional<RunPart>& part)
{
    return part && !file.empty() ? with_part(file, name_of(*part)) : file;
}

std::filesystem::path folder_of(const std::filesystem::path& file)
{
    return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

void check_options(const SceneOptions& scene, const RunOptions& options)
{
    if (const auto& part = options.part;
        part && (part->count < 1 || part->count > max_parts || part->number < 1 || part->number > part->count))
        refuse(fmt::format("part {} of {}: the part must be from 1 to the number of parts, which is at most {}",
                           part->number, part->count, max_parts));
    if (options.sample && !(*options.sample > 0 && *options.sample <= 1))
        refuse(fmt::format("sample = {}; it must be above 0 and at most 1", *options.sample));
    if (options.frames) check_frames(*options.frames);
    if (options.cache.every < 0) refuse(fmt::format("every = {}; it must be at least 0", options.cache.every));
    if (options.cache.again && options.cache.folder.empty())
        refuse("again replaces the contents of a cache; give its folder");
    if (!options.claims.empty() && options.statistics.empty()) refuse("claims need a statistics file; give one");
    // A fingerprint does not cover these.
    if (!options.cache.folder.empty() && (!scene.objects.empty() || !scene.nodes.empty()))
        refuse("a cache can't see changes of the objects and nodes that the program offers; remove them, or the cache");
}

template <class F>
void call_if_set(const F& callback, const auto&... arguments)
{
    if (callback) callback(arguments...);
}

}  // namespace

struct [[gnu::visibility("hidden")]] SceneRun::Impl
{
    const RunOptions options;
    const RunListener listener;
    SceneInside::Impl scene;
    FrameFiles files;
    EventFile events;
    RunCache cache;
    WrittenNames names;
    std::mutex names_mutex;              // scripts on all threads make objects of files
    std::shared_ptr<PartRecord> record;  // null if all points are simulated
    std::optional<InputContents> read;   // of a part
    RunReport report;
    RunFrames frames{0, 0};
    std::int64_t first = 1;  // of the scene
    bool has_opened = false, is_ready = false, has_begun = false;
    std::atomic<bool> computes = false;  // while frames are computed, their inputs are not noted
    std::atomic<bool> is_to_end = false;

    Impl(std::string file, SceneOptions scene_options, SceneHooks hooks, RunOptions requested, RunListener run_listener)
        : options(std::move(requested)),
          listener(std::move(run_listener)),
          files(frame_files(options.files)),
          events(name_in_part(options.events, options.part)),
          cache(options.cache, scene_options.estimate_errors),
          report({file, scene_options.threads > 0 ? scene_options.threads : tbb::this_task_arena::max_concurrency(),
                  name_in_part(options.statistics, options.part), name_in_part(options.profile, options.part)},
                 {[this](const FrameFigures& frame, double seconds, bool is_known) {
                      call_if_set(listener.frame, RunFrame{frame.frame, frame.points, seconds, is_known});
                  },
                  [this](const std::string& text) { call_if_set(listener.line, text); },
                  [this](const std::string& text) { call_if_set(listener.warning, text); }},
                 files, cache.requested() ? &cache : nullptr)
    {
        if (cache.requested()) cache.set_graph(file);
        hooks.keep_state = cache.requested();
        hooks.per_point_diagnostics = false;
        if (options.part) begin_part(file);
        scene.file = std::move(file);
        scene.text = options.text;
        scene.options = std::move(scene_options);
        if (cache.requested()) scene.options.estimate_errors = true;  // until the cache decides
        scene.hooks = std::move(hooks);
        scene.may_write = true;
        if (options.part) note_settings();
        take_hooks();
        scene.plan_of_run = files.plan_options(std::nullopt);
        scene.plan_of_run.keep_steps = !options.events.empty();
        scene.write = [this](const std::string& pattern, const PointSet& points, const Frame& frame, double fps) {
            if (frames.contains(std::llround(frame.number))) files.write_node(pattern, points, frame, fps);
        };
        if (scene.options.threads > 0) scene.arena.emplace(scene.options.threads);
    }

    void begin_part(const std::string& file)
    {
        read.emplace(folder_of(file), InputContents::Code::Included);
        record = std::make_shared<PartRecord>();
        record->part = *options.part;
        record->sample = options.sample;
        files.take_part(record);
    }

    // Notes the settings by which parts recognize each other.
    void note_settings() const
    {
        for (const auto& [name, value] : scene.options.set) record->identity[name] = text_of(value);
        if (scene.options.seed) record->identity[seed_entry] = fmt::format("{}", *scene.options.seed);
        if (options.text) record->identity["the text of the scene"] = hash_text(content_hash(*options.text));
    }

    void take_hooks()
    {
        scene.hooks.on_file_read = [this, on_file_read = std::move(scene.hooks.on_file_read)](const std::string& path) {
            const std::filesystem::path file(path);
            if (!computes) {
                const std::lock_guard lock(names_mutex);
                names.reads(file);
            }
            if (read) read->add(file);
            if (cache.requested()) cache.was_read(file);
            if (on_file_read) on_file_read(path);
        };
        scene.options.log = [this, log = std::move(scene.options.log)](LogLevel level, const std::string& text) {
            if (level == LogLevel::Warning)
                report.warning(text);
            else if (log)
                log(level, text);
        };
    }

    void prepare()
    {
        if (is_ready) refuse("the run is already prepared; call run()");
        if (has_opened) refuse("the run could not be prepared; make a new one");
        has_opened = true;
        claim_own_files();
        std::map<std::string, std::string> set;
        for (const auto& [name, value] : scene.options.set) set[name] = text_of(value);
        scene.take_offers();
        scene.load(std::move(set));
        const Plan& plan = *scene.plan;
        first = plan.first_frame();
        report.set_error_sources(error_sources_of(plan));
        const RunPart part = options.part.value_or(RunPart());
        if (const Subset subset(part.number, part.count, options.sample.value_or(1)); !subset.is_all())
            take_subset(plan, subset);
        frames = range_of(plan);
        if (record) {
            record->frames = frames;
            record->identify(read->take());
        }
        files.resolve(plan, !frames.single());
        files.claim(names, frames);
        if (!options.claims.empty()) files.claim(options.claims, options.statistics);
        is_ready = true;
    }

    // Claims the files that are not of frames. Throws Error if one of them is the scene, or if two are the same.
    void claim_own_files()
    {
        names.reads(scene.file);
        const auto claim = [&](const std::string& file, const std::string& option) {
            if (file.empty()) return;
            try {
                names.add(file, option);
            } catch (const Error& error) {
                throw Error(fmt::format("{} {}: {}", option, file, error.message()), error.kind());
            }
        };
        if (cache.requested())
            for (const char* name : {"journal", "events", ".lock"})
                claim(cache.folder() / name, name_of(Setting::Cache));
        claim(name_in_part(options.statistics, options.part), name_of(Setting::Statistics));
        claim(name_in_part(options.profile, options.part), name_of(Setting::Profile));
        claim(events.path(), name_of(Setting::Events));
    }

    RunFrames range_of(const Plan& plan) const
    {
        const std::int64_t start = plan.first_frame();
        if (!options.frames) return {start, start + default_frames - 1};
        if (options.frames->first < start)
            throw Error(fmt::format("{}: frame {} is before the scene's first, {}", name_of(Setting::Frames),
                                    options.frames->first, start));
        return *options.frames;
    }

    // Returns further options that change the run's data.
    Fingerprint fingerprint_options() const
    {
        Fingerprint all = {{events_entry, options.events.empty() ? "no" : "yes"}};
        if (options.part) all[part_entry] = name_of(*options.part);
        if (options.sample) all[sample_entry] = fmt::format("{}", *options.sample);
        return all;
    }

    // Throws errors found before the first frame.
    RunOutcome run()
    {
        if (!is_ready) refuse("the run is not prepared; call prepare() first");
        if (has_begun) refuse("the run is already complete; make a new one");
        has_begun = true;
        events.begin();
        if (cache.requested()) {
            cache.begin(*scene.session, *scene.plan, frames, fingerprint_options(), files, events);
            if (!cache.estimates_errors()) scene.evaluator->disable_error_estimates();
        }
        computes = true;
        RunOutcome outcome;
        outcome.last_frame = first - 1;
        try {
            const std::int64_t last = compute(outcome);
            if (outcome.ending == RunOutcome::Ended) {
                files.finish(false);
                finish_cache(false);
                add_unwritten(outcome, report.finish_early());
                return outcome;
            }
            if (cache.first_due())  // after the frames of an earlier run
                for (const FrameRecord* known : cache.records(last + 1, frames.last)) report.known_frame(*known, false);
            files.finish();
            finish_cache(true);
            events.finish();
            outcome.summary = report.finish();
            outcome.last_frame = frames.last;
        } catch (...) {
            outcome.ending = RunOutcome::Failed;
            outcome.error = scene.error_of_call(SceneError::FailedFrame);
            finish_files(outcome.error->text());
            add_unwritten(outcome, report.finish_early());
        }
        return outcome;
    }

    // Returns the last frame that is due.
    std::int64_t compute(RunOutcome & outcome)
    {
        Evaluator& evaluator = *scene.evaluator;
        // Active until the last frame is computed: files written then must not count.
        const SceneInside::Impl::Running running(scene);
        std::int64_t last = frames.last;
        if (cache.requested()) last = continue_from_cache();
        outcome.last_frame = std::max(outcome.last_frame, evaluator.next_frame() - 1);
        call_if_set(listener.begins, cache.keeps_snapshots());
        while (evaluator.next_frame() <= last) {
            const FrameResult result = evaluator.advance();
            outcome.last_frame = result.frame;
            for (const std::string& warning : scene.session->take_warnings()) report.warning(warning, result.frame);
            for (const std::string& warning : result.warnings) report.warning(warning, result.frame);
            if (frames.contains(result.frame)) files.write(result);
            for (const std::string& name : files.take_first_names()) report.line("writing " + name);
            for (const std::string& warning : files.take_warnings()) report.warning(warning, result.frame);
            report.frame(result);
            events.add(result);
            const bool ends = is_to_end;
            if (cache.requested()) cache.keep(evaluator, events, ends);
            if (ends) {
                outcome.ending = RunOutcome::Ended;
                break;
            }
            for (const std::string& warning : cache.take_warnings()) report.warning(warning, result.frame);
        }
        return last;
    }

    // Reports the cache's frames, and takes the evaluator there. Returns the last frame to compute.
    std::int64_t continue_from_cache()
    {
        Evaluator& evaluator = *scene.evaluator;
        cache.restore(evaluator, events);
        for (const std::string& warning : cache.take_warnings()) report.warning(warning);
        const std::int64_t known = cache.first_due() ? evaluator.next_frame() - 1 : frames.last;
        for (const FrameRecord* one : cache.records(first, known)) report.known_frame(*one, true);
        if (known >= first)
            report.line(fmt::format("frames {}-{} are known from {}", first, known, cache.folder().string()));
        return cache.first_due() ? cache.last_due() : first - 1;
    }

    void finish_cache(bool complete)
    {
        if (!cache.requested()) return;
        cache.finish(complete);
        for (const std::string& warning : cache.take_warnings()) report.warning(warning);
    }

    // Writes the complete frames before the one that failed, or says why not.
    void finish_files(const std::string& reason)
    {
        try {
            files.finish(false);
        } catch (const std::exception& error) {
            if (error.what() != reason) report.warning(error.what());
        }
    }

    static void add_unwritten(RunOutcome & outcome, const std::string& failure)
    {
        if (!failure.empty()) outcome.unwritten.push_back(failure);
    }
};

SceneRun::SceneRun(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
SceneRun::SceneRun(SceneRun&&) noexcept = default;
SceneRun& SceneRun::operator=(SceneRun&&) noexcept = default;
SceneRun::~SceneRun() = default;

Result<SceneRun> SceneRun::make(std::string file, SceneOptions scene, RunOptions options, RunListener listener)
{
    return SceneInside::make(std::move(file), std::move(scene), {}, std::move(options), std::move(listener));
}

Result<SceneRun> SceneInside::make(std::string file, SceneOptions scene, SceneHooks hooks, RunOptions options,
                                   RunListener listener)
{
    if (file.empty()) return wrong_call("no file is given; give the path of a scene, such as graphs/first.lua");
    if (std::optional<SceneError> fault = fault_of(scene)) return std::move(*fault);
    try {
        check_options(scene, options);
        return SceneRun(std::make_unique<SceneRun::Impl>(std::move(file), std::move(scene), std::move(hooks),
                                                         std::move(options), std::move(listener)));
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<Done> SceneRun::prepare()
{
    return impl_->scene.call(SceneError::WrongScene, [&] {
        impl_->prepare();
        return Done();
    });
}

std::int64_t SceneRun::first_frame() const { return impl_->first; }
RunFrames SceneRun::frames() const { return impl_->frames; }

Result<std::vector<std::pair<std::string, std::string>>> SceneInside::merges(SceneRun& run, int parts)
{
    return run.impl_->scene.call(SceneError::WrongCall, [&] {
        if (!run.impl_->is_ready) refuse("the run is not prepared; call prepare() first");
        if (parts < 1 || parts > max_parts)
            refuse(fmt::format("parts = {}; it must be from 1 to {}", parts, max_parts));
        if (run.impl_->options.part) refuse("the run is itself a part");
        if (parts > 1) refuse_coupled(*run.impl_->scene.plan);
        return run.impl_->files.merges();
    });
}

Result<RunOutcome> SceneRun::run()
{
    return impl_->scene.call(SceneError::WrongScene, [&] { return impl_->run(); });
}

void SceneRun::end_after_frame() { impl_->is_to_end = true; }
void SceneRun::cancel() { impl_->scene.cancel(); }

std::optional<Abandoned> SceneInside::abandon(SceneRun& run)
{
    try {
        std::optional<RunReport::Abandoned> abandoned = run.impl_->report.abandon();
        if (!abandoned) return std::nullopt;
        Abandoned result{std::move(abandoned->warnings), {}};
        if (!abandoned->failure.empty()) result.unwritten.push_back(std::move(abandoned->failure));
        return result;
    } catch (...) {  // out of memory
        return std::nullopt;
    }
}

Result<std::vector<std::string>> SceneInside::output_folders(const RunOptions& options)
{
    FileOutputs files = options.files;
    for (std::string& output : files.outputs) output = name_in_part(output, options.part);
    Result<std::vector<std::string>> folders = output_folders(files);
    if (!folders) return folders;
    try {
        for (const std::string& file : {options.statistics, options.profile, options.events})
            if (!file.empty()) folders->push_back(folder_of(name_in_part(file, options.part)).string());
        for (const std::string& folder : {options.cache.folder, options.claims})
            if (!folder.empty()) folders->push_back(folder);
        for (const std::string& folder : *folders) std::filesystem::create_directories(folder);
        return folders;
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

}  // namespace rapid
