// Reports on a run while it goes on and when it ends, however it ends: its frames, its warnings, and the files of its
// statistics and profile, which also have a cached form.
#pragma once

#include <chrono>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bindings/run/frame_files.h"
#include "bindings/run/run_cache.h"
#include "runtime/base/error.h"
#include "runtime/base/stopwatch.h"
#include "runtime/files/output_file.h"
#include "runtime/graph/evaluate.h"
#include "runtime/io/frame_writer.h"
#include "runtime/report/frame_warnings.h"
#include "runtime/report/statistics.h"

namespace rapid {

// The file of --stats, written during the run, so that frames need not be held in memory.

// Failures are reported at the end: the frames of the run are more important.
class StatisticsFile {
public:
    StatisticsFile(std::string path, const RunStatistics& run);

    // A frame waits for the time of writing its files, which is known later.
    void add(const FrameFigures& frame);
    void add_writing(std::int64_t frame, double seconds);
    // Writes the frames before this one, whose files are all complete; without a value, all frames.
    void write_before(std::optional<std::int64_t> frame, const ErrorSources& errors);

    // Writes all frames and the end, and names the file; a second call does nothing. Throws Error if it could not be
    // written.
    void finish(const RunStatistics& run);

private:
    void append(const std::string& text);

    const std::string path_;
    std::optional<OutputFile> file_;
    std::optional<Error> error_;
    std::deque<FrameFigures> waiting_;
    bool is_first_ = true, is_finished_ = false;
};

// The file of --profile: the time of each pass, frame and file, in Chrome's trace format, which the browser
// (chrome://tracing) and Perfetto open.

// Written during the run. Failures are reported at the end: the frames of the run are more important.
class ProfileFile {
public:
    explicit ProfileFile(std::string path);

    void add(const FrameResult& result);
    void add(const FrameWriter::Written& file);

    // Ends the list and names the file; a second call does nothing. Throws Error if it could not be written.
    void finish();

private:
    using Clock = std::chrono::steady_clock;
    double microseconds(Clock::time_point moment) const;
    void append(const std::string& event);

    const std::string path_;
    const Clock::time_point begin_ = Clock::now();
    std::optional<OutputFile> file_;
    std::optional<Error> error_;
    bool is_first_ = true, is_finished_ = false;
    std::vector<double> lanes_;  // µs, when the last file of each row of files was done: those of a row do not overlap
};

class RunReport {
public:
    struct Options {
        std::string graph;
        int threads = 1;
        std::string stats_file;    // empty: none
        std::string profile_file;  // likewise
    };
    // Called one at a time; none may be empty.
    struct Listener {
        std::function<void(const FrameFigures& frame, double seconds, bool is_known)> frame;
        std::function<void(const std::string& text)> line;
        std::function<void(const std::string& text)> warning;
    };
    // The run's time begins here. files: those that the run writes; cache: is notified of all frames; null if there is
    // none.
    RunReport(Options options, Listener listener, FrameFiles& files, RunCache* cache);

    // Must be called before the first frame: the sources of error that no estimate includes.
    void set_error_sources(ErrorSources errors) { run_.errors = std::move(errors); }

    // Reports a frame that an earlier run has computed; is_before: before all that this one computes.
    void known_frame(const FrameRecord& record, bool is_before);
    void frame(const FrameResult& result);
    void line(const std::string& text);
    // Reports each text once.
    void warning(const std::string& text);
    // Reports a warning of a frame. Warnings tend to repeat in later frames: the first of those that differ only in
    // numbers are printed at once, and the others are counted for the end.
    void warning(const std::string& text, std::int64_t frame);

    // Ends a complete run: reports the counted warnings, and writes statistics and profile. Returns the summary. Throws
    // Error if a file cannot be written.
    std::string finish();
    // Ends an incomplete run. Returns why a file could not be written; empty if all were.
    std::string finish_early();
    // Called from another thread at any time, before the process ends: later reports do not return. Returns nothing if
    // the run's own thread does not release the lock within a second.
    struct Abandoned {
        std::vector<std::string> warnings;
        std::string failure;  // as finish_early()
    };
    std::optional<Abandoned> abandon();

private:
    // Locks for reports of the run's own thread. Does not return if the run has been abandoned.
    std::unique_lock<std::timed_mutex> locked();
    void add_writing();
    // Writes statistics and profile. Throws Error if a file cannot be written.
    void write_statistics();
    std::string try_to_write();
    void report_warning(const std::string& text, std::int64_t frame);
    void report_suppressed();
    double now() const;

    const Listener listener_;
    FrameFiles& files_;
    RunCache* const cache_;
    const Stopwatch stopwatch_;
    double earlier_seconds_ = 0;  // of the runs that this one continues
    std::uint64_t earlier_peak_ = 0;

    std::timed_mutex mutex_;
    bool is_abandoned_ = false;
    RunStatistics run_;
    RunTotals totals_;
    std::optional<StatisticsFile> statistics_;
    std::optional<ProfileFile> profile_;
    std::set<std::string> warned_;  // without a frame: limited by the scene
    FrameWarnings frame_warnings_;
};

}  // namespace rapid
