// What is told of a run while it goes on and when it ends, however it ends: its frames, its warnings, the files of its
// statistics and its profile; and what a cache keeps of all that.
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bindings/run/frame_files.h"
#include "bindings/run/profile_file.h"
#include "bindings/run/run_cache.h"
#include "bindings/run/statistics_file.h"
#include "runtime/report/frame_warnings.h"
#include "runtime/report/totals.h"
#include "runtime/stopwatch.h"

namespace rapid {

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
        std::function<void(const FrameStatistics& frame, double seconds, bool is_known)> frame;
        std::function<void(const std::string& text)> line;
        std::function<void(const std::string& text)> warning;
    };
    // The run's time begins here. files: those that the run writes; cache: hears of all frames, null where there is
    // none.
    RunReport(Options options, Listener listener, FrameFiles& files, RunCache* cache);

    // A frame that an earlier run has computed; is_before: before all that this one computes.
    void known_frame(const FrameRecord& record, bool is_before);
    void frame(const FrameResult& result);
    void line(const std::string& text);
    // Each text once.
    void warning(const std::string& text);
    // Of a frame. Warnings tend to repeat in the next ones: of those that differ in numbers alone the first are told as
    // they come, and the rest is counted for the end.
    void warning(const std::string& text, std::int64_t frame);

    // The run is complete: tells what was only counted, and writes statistics and profile. Returns the summary. Error:
    // a file can't be written.
    std::string finish();
    // It ends before. Returns why a file could not be written; empty where they were.
    std::string finish_early();
    // From another thread, at any moment, before the process ends: what is told afterwards does not return. Nothing
    // where the run's own thread does not let go within a second.
    struct Abandoned {
        std::vector<std::string> warnings;
        std::string failure;  // as finish_early()
    };
    std::optional<Abandoned> abandon();

private:
    // For what the run's own thread tells. Does not return where the run has been abandoned.
    std::unique_lock<std::timed_mutex> locked();
    void add_writing();
    // Statistics and profile. Error: a file can't be written.
    void write_statistics();
    std::string try_to_write();
    void tell(const std::string& text, std::int64_t frame);
    void tell_untold();
    double now() const;

    const Listener listener_;
    FrameFiles& files_;
    RunCache* const cache_;
    const Stopwatch stopwatch_;
    double earlier_seconds_ = 0;  // of the runs that this one goes on behind
    std::uint64_t earlier_peak_ = 0;

    std::timed_mutex mutex_;
    bool is_abandoned_ = false;
    RunStatistics run_;
    RunTotals totals_;
    std::optional<StatisticsFile> statistics_;
    std::optional<ProfileFile> profile_;
    std::set<std::string> warned_;  // of no frame: as many as the scene makes
    FrameWarnings frame_warnings_;
};

}  // namespace rapid
