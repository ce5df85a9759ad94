// rapid run: computes the frames in order and writes them.
#include <fmt/format.h>

#include <csignal>

#include "bindings/command/command.h"
#include "bindings/run/event_file.h"
#include "bindings/command/farm_options.h"
#include "bindings/run/fingerprint.h"
#include "bindings/run/frame_files.h"
#include "bindings/command/frame_selection.h"
#include "bindings/command/graceful_end.h"
#include "bindings/command/graph_options.h"
#include "bindings/command/memory_limit.h"
#include "bindings/command/part_options.h"
#include "bindings/run/part_record.h"
#include "bindings/run/run_cache.h"
#include "bindings/command/run_report.h"
#include "bindings/command/signals.h"
#include "bindings/command/untrusted.h"
#include "bindings/command/watch.h"
#include "bindings/run/written_names.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/files/output_file.h"
#include "runtime/graph/coupling.h"
#include "runtime/graph/evaluate.h"
#include "runtime/threads.h"

namespace rapid {
namespace {

class Run : public Command, public Confined {
public:
    std::string name() const override { return "run"; }
    std::string doc() const override { return "computes the frames of a graph and writes them"; }

    void declare(CLI::App& app) override
    {
        app_ = &app;
        graph_.declare(app);
        app.add_option_function<std::string>(
               "-f,--frames", [this](const std::string& text) { frames_ = read_frames(text); },
               fmt::format("the frames to write: 1-48, 1-48x2 (every second), or 12; all before them are computed too "
                           "[default: {} from the first]",
                           default_frames))
            ->type_name("FRAMES");
        files_.declare(app);
        part_.declare(app);
        app.add_option("--stats", stats_, "writes points and seconds of each frame as JSON")->type_name("FILE");
        app.add_option("--profile", profile_,
                       "writes what each node, frame and file took as a trace, which Chrome and Perfetto open")
            ->type_name("FILE");
        events_.declare(app);
        cache_.declare(app);
        app.add_flag("--durable", durable_, "a frame has its name when it is on the disk, and outlasts a power cut");
        app.add_flag("--keep-all", keep_all_,
                     "leaves nothing out: every attribute is there, everything is evaluated each frame; the files are "
                     "the same");
        app.add_flag("--quiet", quiet_, "no progress and no summary; without --stats, no errors are estimated");
        untrusted_.declare(app, "graph");
        app.add_option("--claims", claims_)->group("");  // internal: where rows of a wedge note what they write
        app.add_flag("--watch", watch_, "runs again when the graph, or a file that it read, changes; Ctrl-C ends it");
        farm_.declare(app);
        app.add_option_function<std::string>(
               "--parts", [this](const std::string& text) { parts_ = read_whole("--parts", text, 1); },
               "with --farm: tasks, each of one part of the points, which are then merged [default 1]")
            ->type_name("N");
        app.add_flag(Watch::tell_option, tell_)->group("");  // internal: a run of --watch
    }

    void confine(const CommonOptions& common) override
    {
        if (watch_ && untrusted_.asked())
            throw Error("--watch starts processes, which --untrusted forbids; give one of them");
        if (watch_ && cache_.asked())
            throw Error("--watch runs a graph that changes, of which --cache holds nothing; give one of them");
        cache_.check();
        if (untrusted_.asked() && files_.makes_films())
            throw Error("films are made by a program of its own, which --untrusted forbids; write pictures (.png)");
        check_farm();
        begin_part();
        untrusted_.confine([&] { return access(); }, common);
    }
    // --watch runs the graph in processes of its own.
    bool takes_plugins() const override { return !watch_ || tell_; }

    int run(const CommonOptions& common) override
    {
        if (watch_ && !tell_) return Watch(graph_.file(), quiet_).run();
        if (durable_) make_files_durable();
        std::signal(SIGPIPE, SIG_IGN);  // the reader of its output may go before it ends
        Threads threads(common.threads);
        RunReport report({graph_.file(), threads.count(), stats_, profile_, quiet_, common.verbose}, files_);
        GracefulEnd end(cache_.grace(), [&](int signal) {
            report.abandon(128 + signal, "interrupted; the frame took longer than the --grace, and is dropped");
        });
        const SignalThread signals([&](int signal) {
            if (!end.ask(signal)) report.abandon(128 + signal, "interrupted");
        });
        if (cache_.asked()) {
            cache_.set_graph(graph_.file());
            graph_.keep_state();
        }

        return threads.run([&] {
            claim_own_files();
            const auto abandon = [&](const std::string& message) { report.abandon(status_failed, message); };
            std::optional<MemoryLimit> limit(std::in_place, graph_.file(), abandon);
            const std::unique_ptr<Session> session = graph_.load(true, abandon, on_read());
            for (const std::string& warning : session->take_warnings()) report.warning(warning);
            PlanOptions options = files_.plan_options(graph_.seed());
            options.keep_all = keep_all_;
            options.keep_steps = !events_.path().empty();
            const Plan plan(session->graph(), options);
            for (const std::string& warning : plan.warnings) report.warning(warning);
            if (!part_.subset().is_all()) take_subset(plan, part_.subset());

            const FrameSelection frames = range_of(plan);
            if (record_) {
                record_->frames = frames;
                record_->identify(read_->take());
            }
            files_.resolve(plan, !frames.single());
            files_.claim(names_, frames);
            if (!claims_.empty()) files_.claim(claims_, stats_);
            if (farm_.asked()) return submit(plan);
            events_.begin();
            if (cache_.asked()) {
                cache_.begin(*session, plan, frames, fingerprint_options(), files_, events_);
                report.set_cache(&cache_);
            }
            report.begin(plan.first_frame(), frames.last);
            return compute(*session, plan, frames, report, end, limit);
        });
    }

private:
    // Files of a part have names of their own.
    void begin_part()
    {
        if (!part_.part()) return;
        const std::string name = name_of(*part_.part());
        read_.emplace(folder_of(graph_.file()), InputContents::Code::Included);
        record_ = std::make_shared<PartRecord>();
        record_->part = *part_.part();
        record_->sample = part_.sample();
        std::map<std::string, std::string>& identity = record_->identity;
        identity = graph_.session().set;
        if (graph_.seed()) identity["--seed"] = fmt::format("{}", *graph_.seed());
        files_.take_part(record_);
        events_.take_part(name);
        for (std::string* file : {&stats_, &profile_})
            if (!file->empty()) *file = with_part(*file, name);
    }

    void check_farm() const
    {
        farm_.check();
        if (!farm_.asked() && parts_ > 1) throw Error("--parts is for --farm; give --farm slurm, or --part K/N");
        if (parts_ > most_parts) throw Error(fmt::format("--parts = {}; it must be at most {}", parts_, most_parts));
        if (!farm_.asked()) return;
        if (watch_) throw Error("--watch runs here, and --farm elsewhere; give one of them");
        if (untrusted_.asked())
            throw Error("--farm starts programs, which --untrusted forbids; submit `rapid run --untrusted` by sbatch");
        if (parts_ > 1 && part_.part()) throw Error("--parts and --part are given together; keep one of them");
    }

    // What would be found wrong before the first frame has been.
    int submit(const Plan& plan) const
    {
        FarmJob job;
        job.name = "rapid-" + std::filesystem::path(graph_.file()).stem().string();
        const std::vector<std::filesystem::path> folders = files_.folders();
        job.outputs = folders.empty() ? "." : folders.front();
        job.words = farm_.words(*app_, {"--parts"});
        job.words.emplace_back("--quiet");
        // Each task has a cache of its own.
        std::string cache = (std::filesystem::absolute(job.scripts()) / "cache").string();
        std::erase_if(job.words, [&](const std::string& word) {
            if (!word.starts_with("--cache=")) return false;
            cache = word.substr(std::string_view("--cache=").size());
            return true;
        });
        if (parts_ == 1) {
            job.tasks.push_back({"run", {"--cache=" + cache}});
            return farm_.submit(std::move(job));
        }
        take_subset(plan, Subset(Part{1, static_cast<int>(parts_)}, std::nullopt));
        for (int number = 1; number <= parts_; ++number) {
            const std::string name = name_of({number, static_cast<int>(parts_)});
            job.tasks.push_back(
                {"part " + name,
                 {fmt::format("--part={}/{}", number, parts_), fmt::format("--cache={}/{}", cache, name)}});
        }
        for (const auto& [whole, parts] : files_.merges())
            job.last.push_back({"merge", "--quiet", "--output=" + whole, parts});
        if (job.last.empty()) throw Error("--parts: nothing is written that could be put together; give -o");
        return farm_.submit(std::move(job));
    }

    // Those that are not of frames. Error: one of them is the graph, or two are one.
    void claim_own_files()
    {
        names_.reads(graph_.file());
        const auto claim = [&](const std::string& file, const std::string& option) {
            if (file.empty()) return;
            try {
                names_.add(file, option);
            } catch (const Error& error) {
                throw Error(fmt::format("{} {}: {}", option, file, error.message()));
            }
        };
        if (cache_.asked())
            for (const char* name : {"journal", "events", ".lock"}) claim(cache_.folder() / name, "--cache");
        claim(stats_, "--stats");
        claim(profile_, "--profile");
        claim(events_.path(), "--events");
    }

    std::function<void(const std::filesystem::path& file)> on_read()
    {
        return [this](const std::filesystem::path& file) {
            if (!computes_) names_.reads(file);
            if (record_) read_->add(file);
            if (cache_.asked()) cache_.was_read(file);
            if (tell_) Watch::tell(file);
        };
    }

    SandboxAccess access() const
    {
        SandboxAccess access{{folder_of(graph_.file())}, files_.folders()};
        if (cache_.asked()) {
            std::filesystem::create_directories(cache_.folder());
            access.writable.push_back(cache_.folder());
        }
        if (!claims_.empty()) access.writable.push_back(claims_);
        for (const std::string& file : {stats_, profile_, events_.path()}) {
            if (file.empty()) continue;
            access.writable.push_back(folder_of(file));
            std::filesystem::create_directories(access.writable.back());
        }
        return access;
    }

    FrameSelection range_of(const Plan& plan) const
    {
        const std::int64_t start = plan.first_frame();
        const FrameSelection range = frames_.value_or(FrameSelection{start, start + default_frames - 1});
        if (range.first < start)
            throw Error(fmt::format("-f: frame {} is before the scene's first, {}", range.first, start));
        return range;
    }

    bool estimates_errors() const { return !quiet_ || !stats_.empty(); }

    // What else changes what a run keeps.
    Fingerprint fingerprint_options() const
    {
        const auto answer = [](bool is) { return is ? "yes" : "no"; };
        Fingerprint options = {{"the estimate of errors", answer(estimates_errors())},
                               {"--events", answer(!events_.path().empty())},
                               {"--keep-all", answer(keep_all_)}};
        if (part_.part()) options["--part"] = name_of(*part_.part());
        if (part_.sample()) options["--sample"] = fmt::format("{}", *part_.sample());
        return options;
    }

    // limit: ends when the last frame is computed; files that are written then are no reason to grow.
    int compute(Session& session, const Plan& plan, const FrameSelection& frames, RunReport& report, GracefulEnd& end,
                std::optional<MemoryLimit>& limit)
    {
        computes_ = true;
        try {
            Evaluator evaluator(
                plan, [&](const std::string& pattern, const PointSet& points, const Frame& frame, double fps) {
                    if (frames.contains(std::llround(frame.number))) files_.write_node(pattern, points, frame, fps);
                });
            if (!estimates_errors()) evaluator.leave_out_errors();
            std::int64_t last = frames.last;
            if (cache_.asked()) last = go_on(evaluator, plan, frames, report);
            if (cache_.keeps_snapshots()) end.allow();
            while (evaluator.next_frame() <= last) {
                const FrameResult result = evaluator.advance();
                for (const std::string& warning : session.take_warnings()) report.warning(warning, result.frame);
                for (const std::string& warning : result.warnings) report.warning(warning, result.frame);
                if (frames.contains(result.frame)) files_.write(result);
                for (const std::string& name : files_.take_first_names()) report.line("writing " + name);
                for (const std::string& warning : files_.take_warnings()) report.warning(warning, result.frame);
                report.frame(result);
                events_.add(result);
                if (!cache_.asked()) continue;
                cache_.keep(evaluator, events_, end.signal() != 0);
                if (end.signal() != 0) return interrupted(result.frame, report, end.signal());
                for (const std::string& warning : cache_.take_warnings()) report.warning(warning, result.frame);
            }
            limit.reset();
            if (cache_.first_due())  // what an earlier run has computed behind it
                for (const FrameRecord* record : cache_.records(last + 1, frames.last))
                    report.known_frame(*record, false);
            files_.finish();
            finish_cache(true, report);
            events_.finish();
            report.finish();
            return status_done;
        } catch (const Error& error) {
            limit.reset();
            finish_files(error, report);
            return report.fail(error);
        } catch (const std::exception& error) {  // of a library
            limit.reset();
            const Error known(dynamic_cast<const std::bad_alloc*>(&error) ? "out of memory" : error.what());
            finish_files(known, report);
            return report.fail(known);
        }
    }

    // Tells what the cache has, and takes the evaluator there. Returns the last frame to compute.
    std::int64_t go_on(Evaluator& evaluator, const Plan& plan, const FrameSelection& frames, RunReport& report)
    {
        cache_.restore(evaluator, events_);
        for (const std::string& warning : cache_.take_warnings()) report.warning(warning);
        const std::int64_t first = plan.first_frame();
        const std::int64_t known = cache_.first_due() ? evaluator.next_frame() - 1 : frames.last;
        for (const FrameRecord* record : cache_.records(first, known)) report.known_frame(*record, true);
        if (known >= first && !quiet_)
            report.line(fmt::format("frames {}-{} are known from {}", first, known, cache_.folder().string()));
        return cache_.first_due() ? cache_.last_due() : first - 1;
    }

    void finish_cache(bool complete, RunReport& report)
    {
        if (!cache_.asked()) return;
        cache_.finish(complete);
        for (const std::string& warning : cache_.take_warnings()) report.warning(warning);
    }

    int interrupted(std::int64_t frame, RunReport& report, int signal)
    {
        files_.finish(false);
        finish_cache(false, report);
        return report.interrupted(signal,
                                  fmt::format("interrupted after frame {}; the same command goes on behind it", frame));
    }

    // Writes the frames before the one that failed, which are complete, or says why not.
    void finish_files(const Error& reason, RunReport& report)
    {
        try {
            files_.finish(false);
        } catch (const std::exception& error) {
            if (std::string_view(error.what()) != reason.what()) report.warning(error.what());
        }
    }

    CLI::App* app_ = nullptr;
    FarmOptions farm_;
    std::int64_t parts_ = 1;
    GraphOptions graph_;
    FrameFiles files_;
    std::optional<FrameSelection> frames_;
    PartOptions part_;
    std::shared_ptr<PartRecord> record_;  // null where all points are simulated
    std::optional<InputContents> read_;   // of a part
    std::string stats_, profile_, claims_;
    EventFile events_;
    WrittenNames names_;
    bool computes_ = false;  // frames: what they read is not noted
    RunCache cache_;
    UntrustedOptions untrusted_;
    bool durable_ = false, keep_all_ = false, quiet_ = false, watch_ = false, tell_ = false;
};
RAPID_COMMAND(Run);

}  // namespace
}  // namespace rapid
