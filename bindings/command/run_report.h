// The output of `rapid run` while it runs and when it ends, however it ends.
#pragma once

#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "bindings/command/command.h"
#include "bindings/run/frame_files.h"
#include "bindings/run/profile_file.h"
#include "bindings/run/run_cache.h"
#include "bindings/run/statistics_file.h"
#include "runtime/report/frame_warnings.h"
#include "runtime/report/progress.h"
#include "runtime/report/totals.h"
#include "runtime/stopwatch.h"

namespace rapid {

// Frames, progress and summary go to standard output, warnings and errors to standard error.
class RunReport {
public:
    struct Options {
        std::string graph;
        int threads = 1;
        std::string stats_file;    // empty: none
        std::string profile_file;  // likewise
        bool quiet = false, verbose = false;
    };
    // The run's time begins here. files: those that the run writes.
    RunReport(Options options, FrameFiles& files);

    // Hears of all frames from now on.
    void set_cache(RunCache* cache) { cache_ = cache; }

    void begin(std::int64_t first, std::int64_t last);
    // A frame that an earlier run has computed; is_before: before all that this one computes.
    void known_frame(const FrameRecord& record, bool is_before);
    void frame(const FrameResult& result);
    void line(const std::string& text);
    // Each text once.
    void warning(const std::string& text);
    // Of a frame. Warnings tend to repeat in the next ones: of those that differ in numbers alone the first are told as
    // they come, and the rest is counted for the end.
    void warning(const std::string& text, std::int64_t frame);

    // The statistics file and the summary. Error: the file can't be written.
    void finish();
    // A signal that ends the run between two frames: says so, and writes the statistics and the profile of the frames
    // so far. Returns the status of the process.
    int interrupted(int signal, const std::string& why);
    // An error that ends the run: reports it, and writes the statistics and the profile of the frames so far.
    int fail(const Error& error);
    // From another thread, at any moment: says why, writes the statistics, removes unfinished files, and ends the
    // process.
    [[noreturn]] void abandon(int status, const std::string& why);

private:
    void add_writing();
    // Statistics and profile. Error: a file can't be written.
    void write_statistics();
    void tell_untold();
    void tell(const std::string& text, std::int64_t frame);
    int end_early(int status, const Error& error);
    double now() const;

    const Options options_;
    FrameFiles& files_;
    RunCache* cache_ = nullptr;
    const Stopwatch stopwatch_;
    double earlier_seconds_ = 0;  // of the runs that this one goes on behind
    std::uint64_t earlier_peak_ = 0;

    std::timed_mutex mutex_;
    RunStatistics run_;
    RunTotals totals_;
    std::optional<StatisticsFile> statistics_;
    std::optional<ProfileFile> profile_;
    std::optional<Progress> progress_;
    std::set<std::string> warned_;  // of no frame: as many as the scene makes
    FrameWarnings frame_warnings_;
};

}  // namespace rapid
