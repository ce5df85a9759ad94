// rapid run: computes the frames in order and writes them.
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <optional>

#include "bindings/command/cache_options.h"
#include "bindings/command/farm.h"
#include "bindings/command/file_options.h"
#include "bindings/command/graceful_end.h"
#include "bindings/command/part_options.h"
#include "bindings/command/run_terminal.h"
#include "bindings/command/watch.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/memory_limit.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/signals.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/scene_inside.h"
#include "runtime/base/threads.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/files/output_file.h"

namespace rapid {
namespace {

class Run : public Command, public Confined {
public:
    std::string name() const override { return "run"; }
    std::string doc() const override { return "computes the frames of a graph and writes them"; }

    void declare(Options& options) override
    {
        given_ = &options;
        graph_.declare(options);
        declare_frames(options, frames_,
                       fmt::format("the frames to write: 1-48, 1-48x2 (every second) or 12; all frames before them are "
                                   "computed too [default: {} from the first]",
                                   default_frames));
        files_.declare(options);
        part_.declare(options);
        options.add_option("--stats", options_.statistics, "writes counts, times and errors of each frame as JSON")
            .type_name("FILE");
        options
            .add_option("--profile", options_.profile,
                        "writes the time of each node, frame and file as a trace for Chrome and Perfetto")
            .type_name("FILE");
        options
            .add_option("--events", options_.events,
                        "writes births, contacts and deaths with their positions and times as points (any format that "
                        "can be read: .csv, .bgeo, .npz, ...)")
            .type_name("FILE");
        declare_cache(options);
        options.add_flag("--durable", durable_,
                         "waits for the disk before a frame gets its name, so that it survives a power cut");
        options.add_flag(
            "--keep-all", keep_all_,
            "prunes nothing: keeps every attribute and evaluates every node in every frame; the files are the same");
        options.add_flag("--quiet", quiet_, "no progress and no summary; without --stats, no errors are estimated");
        untrusted_.declare(options, "graph");
        options.add_option("--claims", options_.claims).internal();  // where rows of a wedge claim their output files
        options.add_flag("--watch", watch_, "runs again when the graph or a file that it read changes; Ctrl-C ends it");
        farm_.declare(options);
        options
            .add_option(
                "--parts", [this](const std::string& text) { parts_ = read_whole("--parts", text, 1); },
                "with --farm: number of parts of the points, each a task; they are merged at the end [default 1]")
            .type_name("N");
        options.add_flag(Watch::report_option, reports_files_).internal();  // a run of --watch
    }

    void confine(const CommonOptions& common) override
    {
        if (watch_ && untrusted_.requested())
            throw Error("--watch starts processes, which --untrusted does not allow; remove one of them");
        if (watch_ && cache_.requested())
            throw Error("--watch runs a changing graph, which --cache can't resume; remove one of them");
        if (!farm_.requested()) cache_.check();  // on a farm each task has its own
        if (cache_.again() && !cache_.requested())
            throw Error("--again replaces the contents of a cache; add --cache DIR, or remove --again");
        if (untrusted_.requested() && files_.makes_films())
            throw Error("films need the program ffmpeg, which --untrusted does not allow; write pictures (.png)");
        check_farm();
        options_.frames = frames_;
        options_.cache.folder = cache_.folder();
        options_.cache.every = cache_.every().value_or(options_.cache.every);
        options_.cache.again = cache_.again();
        options_.files = files_.files();
        options_.part = part_.part();
        options_.sample = part_.sample();
        untrusted_.confine([&] { return access(); }, common);
    }
    // --watch runs the graph in separate processes.
    bool takes_plugins() const override { return !watch_ || reports_files_; }

    int run(const CommonOptions& common) override
    {
        if (watch_ && !reports_files_) return Watch(graph_.file(), quiet_).run();
        if (durable_) make_files_durable();
        std::signal(SIGPIPE, SIG_IGN);  // the reader of its output may close the pipe
        Threads threads(common.threads);
        RunTerminal terminal(quiet_, common.verbose);
        std::optional<SceneRun> run;  // lives until the others have ended
        std::atomic<SceneRun*> made = nullptr;
        const auto abandon = [&](int status, const std::string& why) {
            if (SceneRun* const it = made) terminal.abandon(*it, status, why);
            _exit(status);
        };
        GracefulEnd end(grace_, [&](int signal) {
            abandon(128 + signal, "interrupted; the frame took longer than --grace allows and is dropped");
        });
        const SignalThread signals([&](int signal) {
            if (end.request(signal))
                run->end_after_frame();
            else
                abandon(128 + signal, "interrupted");
        });
        return threads.run([&] {
            const auto fail = [&](const std::string& message) { abandon(status_failed, message); };
            run.emplace(make(fail, terminal.listener([&](bool keeps_snapshots) {
                if (keeps_snapshots) end.allow();
            })));
            made = &*run;
            {
                const MemoryLimit limit(graph_.file(), fail);
                run->prepare().value();
            }
            if (farm_.requested()) return submit(*run);
            terminal.begin(run->first_frame(), run->frames().last);
            const RunOutcome outcome = run->run().value();
            return terminal.end(outcome, end.signal());
        });
    }

private:
    void declare_cache(Options& options)
    {
        cache_.declare(options,
                       "stores snapshots in this folder and resumes from the last one before the first missing frame; "
                       "existing frames are not computed again",
                       "computes and writes all frames, even if the cache has them");
        options
            .add_option(
                "--grace", [this](const std::string& text) { grace_ = read_positive("--grace", text); },
                "with --cache: time after SIGTERM or Ctrl-C to finish the frame and write a snapshot [default 20]")
            .type_name("SECONDS");
        // For wedge: a cache of another run is not an error.
        options.add_flag("--cache-replace", options_.cache.replace).internal();
    }

    // end: called from another thread if a limit is reached and the run does not end; it must not return.
    SceneRun make(const std::function<void(const std::string& message)>& end, RunListener listener) const
    {
        SceneOptions scene = graph_.scene_options();
        scene.keep_all = keep_all_;
        scene.estimate_errors = !quiet_ || !options_.statistics.empty();
        SceneHooks hooks;
        hooks.on_script_timeout = hooks.on_memory_exceeded = end;
        if (reports_files_) hooks.on_file_read = [](const std::string& file) { Watch::report(file); };
        return SceneInside::make(graph_.file(), std::move(scene), std::move(hooks), options_, std::move(listener))
            .value();
    }

    void check_farm() const
    {
        farm_.check();
        if (!farm_.requested() && parts_ > 1)
            throw Error("--parts needs --farm slurm; to run one part here, give --part K/N");
        if (parts_ > max_parts) throw Error(fmt::format("--parts = {}; it must be at most {}", parts_, max_parts));
        if (!farm_.requested()) return;
        if (watch_) throw Error("--watch runs here and --farm elsewhere; remove one of them");
        if (untrusted_.requested())
            throw Error(
                "--farm starts programs, which --untrusted does not allow; submit `rapid run --untrusted` with sbatch "
                "yourself");
        if (parts_ > 1 && part_.part()) throw Error("--parts and --part are given together; keep one of them");
    }

    // Submits the run. Errors that are detectable before the first frame have already been reported.
    int submit(SceneRun& run) const
    {
        FarmJob job;
        job.name = "rapid-" + std::filesystem::path(graph_.file()).stem().string();
        const std::vector<std::string> folders = SceneInside::output_folders(options_.files).value();
        job.outputs = folders.empty() ? "." : folders.front();
        job.words = farm_.words(*given_, {"--parts"});
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
        const int parts = static_cast<int>(parts_);
        const auto merges = SceneInside::merges(run, parts).value();
        for (int number = 1; number <= parts; ++number) {
            const std::string name = part_name(number, parts);
            job.tasks.push_back(
                {"part " + name,
                 {fmt::format("--part={}/{}", number, parts_), fmt::format("--cache={}/{}", cache, name)}});
        }
        for (const auto& [whole, pattern] : merges)
            job.last.push_back({"merge", "--quiet", "--output=" + whole, pattern});
        if (job.last.empty()) throw Error("--parts: no output files to merge; give -o");
        return farm_.submit(std::move(job));
    }

    SandboxAccess access() const
    {
        SandboxAccess access{{folder_of(graph_.file())}, {}};
        for (const std::string& folder : SceneInside::output_folders(options_).value())
            access.writable.emplace_back(folder);
        return access;
    }

    Options* given_ = nullptr;
    SceneArguments graph_;
    FileOptions files_;
    PartOptions part_;
    CacheOptions cache_;
    std::optional<RunFrames> frames_;
    RunOptions options_;
    double grace_ = 20;  // s
    FarmOptions farm_;
    std::int64_t parts_ = 1;
    UntrustedOptions untrusted_;
    bool durable_ = false, keep_all_ = false, quiet_ = false, watch_ = false, reports_files_ = false;
};
RAPID_COMMAND(Run);

}  // namespace
}  // namespace rapid
