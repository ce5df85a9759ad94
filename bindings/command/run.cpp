// rapid run: computes the frames in order and writes them.
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bindings/command/farm.h"
#include "bindings/command/run_options.h"
#include "bindings/command/watch.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/signals.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/scene_inside.h"
#include "include/rapid/run.h"
#include "runtime/base/threads.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/files/output_file.h"
#include "runtime/report/progress.h"

namespace rapid {

// Handles a signal that ends a run: with snapshots, the current frame may complete within a grace period.
class GracefulEnd {
public:
    // end_now: called with the signal from another thread when the grace period is over; it must not return.
    GracefulEnd(double grace, std::function<void(int signal)> end_now);
    ~GracefulEnd();
    GracefulEnd(const GracefulEnd&) = delete;
    GracefulEnd& operator=(const GracefulEnd&) = delete;

    // Allows a graceful end from now on: there is something to save.
    void allow();
    // Called from the signals' thread. Returns false for the second signal, and if there is nothing to save: the run
    // must end now.
    bool request(int signal);
    // Returns the received signal; 0: none.
    int signal() const;

private:
    void wait();

    const double grace_;
    const std::function<void(int signal)> end_now_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    bool is_allowed_ = false, is_over_ = false;
    int signal_ = 0;
    std::thread thread_;
};

// Options --part and --sample, which select some of the points.
class PartOptions {
public:
    void declare(Options& options);

    const std::optional<RunPart>& part() const { return part_; }
    const std::optional<double>& sample() const { return sample_; }

private:
    std::optional<RunPart> part_;
    std::optional<double> sample_;
};

// The output of `rapid run` on the terminal: frames, progress and summary go to standard output, warnings and errors to
// standard error.
class RunTerminal {
public:
    RunTerminal(bool quiet, bool verbose) : quiet_(quiet), verbose_(verbose) {}

    // Returns the listener that prints a run's lines and warnings. begins: as in RunListener.
    RunListener listener(std::function<void(bool keeps_snapshots)> begins);
    // Starts the progress display, when the frames to compute are known.
    void begin(std::int64_t first, std::int64_t last);
    // Prints how the run ended. signal: the one that ended it; 0: none. Returns the exit status of the process.
    int end(const RunOutcome& outcome, int signal);
    // Ends the process from any thread, at any time: prints why, lets the run write its statistics, and removes
    // unfinished files.
    [[noreturn]] void abandon(SceneRun& run, int status, const std::string& why);

private:
    // Precondition: the lock is held.
    void erase_progress();
    void print_unwritten(const std::vector<std::string>& unwritten) const;

    const bool quiet_, verbose_;
    std::timed_mutex mutex_;
    std::optional<Progress> progress_;
};

GracefulEnd::GracefulEnd(double grace, std::function<void(int signal)> end_now)
    : grace_(grace), end_now_(std::move(end_now))
{
}

GracefulEnd::~GracefulEnd()
{
    {
        const std::lock_guard lock(mutex_);
        is_over_ = true;
        is_allowed_ = false;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
}

void GracefulEnd::allow()
{
    const std::lock_guard lock(mutex_);
    is_allowed_ = true;
}

bool GracefulEnd::request(int signal)
{
    const std::lock_guard lock(mutex_);
    if (!is_allowed_ || signal_ != 0) return false;
    signal_ = signal;
    thread_ = std::thread([this] { wait(); });
    return true;
}

int GracefulEnd::signal() const
{
    const std::lock_guard lock(mutex_);
    return signal_;
}

void GracefulEnd::wait()
{
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, std::chrono::duration<double>(grace_), [&] { return is_over_; })) return;
    const int signal = signal_;
    lock.unlock();
    end_now_(signal);
}

namespace {

std::optional<int> parse_integer(std::string_view text)
{
    int number = 0;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) return {};
    return number;
}

RunPart read_part(const std::string& text)
{
    const std::size_t slash = text.find('/');
    const std::optional<int> number = parse_integer(text.substr(0, slash));
    const std::optional<int> count = slash == std::string::npos ? std::nullopt : parse_integer(text.substr(slash + 1));
    if (!number || !count || *count < 1 || *count > max_parts || *number < 1 || *number > *count)
        throw Error(
            fmt::format("--part = \"{}\"; it must be K/N, with K from 1 to N, and N at most {}", text, max_parts));
    return {*number, *count};
}

double read_sample(const std::string& text)
{
    const double fraction = read_positive("--sample", text);
    if (fraction > 1)
        throw Error(fmt::format("--sample = \"{}\"; it must be a fraction of all points, above 0 and at most 1", text));
    return fraction;
}

}  // namespace

void PartOptions::declare(Options& options)
{
    options
        .add_option(
            "--part", [this](const std::string& text) { part_ = read_part(text); },
            "simulates one of N subsets of the points, which `rapid merge` joins; file names get _part03of16 before "
            "the frame number, or 03of16 instead of {part}")
        .type_name("K/N");
    options
        .add_option(
            "--sample", [this](const std::string& text) { sample_ = read_sample(text); },
            "simulates this fraction of the points, 0.01 for a hundredth: a preview with the same ids and paths")
        .type_name("FRACTION");
}

RunListener RunTerminal::listener(std::function<void(bool keeps_snapshots)> begins)
{
    RunListener listener;
    listener.frame = [this](const RunFrame& frame) {
        const std::lock_guard lock(mutex_);
        if (!frame.is_known) progress_->frame(frame.number, frame.points, frame.seconds);
    };
    listener.line = [this](const std::string& text) {
        const std::lock_guard lock(mutex_);
        progress_->line(text);
    };
    listener.warning = [this](const std::string& text) {
        const std::lock_guard lock(mutex_);
        erase_progress();
        print_warning(text);
    };
    listener.begins = std::move(begins);
    return listener;
}

void RunTerminal::begin(std::int64_t first, std::int64_t last)
{
    const std::lock_guard lock(mutex_);
    progress_.emplace(stdout, quiet_ ? ProgressStyle::None : progress_style(stdout), first, last);
}

int RunTerminal::end(const RunOutcome& outcome, int signal)
{
    const std::lock_guard lock(mutex_);
    erase_progress();
    if (outcome.ending == RunOutcome::Complete) {
        if (!quiet_) print(outcome.summary);
        return status_done;
    }
    const bool has_failed = outcome.ending == RunOutcome::Failed;
    if (has_failed)
        print_error(*outcome.error, verbose_);
    else
        print_error(
            Error(fmt::format("interrupted after frame {}; the same command continues from there", outcome.last_frame)),
            verbose_);
    print_unwritten(outcome.unwritten);
    return has_failed ? status_failed : 128 + signal;
}

void RunTerminal::abandon(SceneRun& run, int status, const std::string& why)
{
    // The run's own thread holds the lock only briefly, unless its terminal is stopped; then proceed without it.
    if (const auto abandoned = SceneInside::abandon(run); abandoned && mutex_.try_lock_for(std::chrono::seconds(1))) {
        erase_progress();
        for (const std::string& warning : abandoned->warnings) print_warning(warning);
        print_error(Error(why), false);
        print_unwritten(abandoned->unwritten);
    }
    remove_unfinished_files();
    _exit(status);
}

void RunTerminal::erase_progress()
{
    if (progress_) progress_->finish();
}

void RunTerminal::print_unwritten(const std::vector<std::string>& unwritten) const
{
    for (const std::string& why : unwritten) print_error(Error(why), verbose_);
}

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
