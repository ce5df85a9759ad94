// The output of `rapid run` on the terminal: frames, progress and summary go to standard output, warnings and errors to
// standard error.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "bindings/command_line/command.h"
#include "include/rapid/run.h"
#include "runtime/report/progress.h"

namespace rapid {

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

}  // namespace rapid
