// `rapid run` on the terminal: frames, progress and summary go to standard output, warnings and errors to standard
// error.
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

    // The lines of a run, and its warnings. begins: as RunListener's.
    RunListener listener(std::function<void(bool keeps_snapshots)> begins);
    // The frames that will be computed are known: there is progress from now on.
    void begin(std::int64_t first, std::int64_t last);
    // Tells how the run ended. signal: that it was ended by; 0: none. Returns the status of the process.
    int end(const RunOutcome& outcome, int signal);
    // From another thread, at any moment: says why the run ends, has it write its statistics, removes unfinished files,
    // and ends the process.
    [[noreturn]] void abandon(SceneRun& run, int status, const std::string& why);

private:
    // Under the lock.
    void erase_progress();
    void print_unwritten(const std::vector<std::string>& unwritten) const;

    const bool quiet_, verbose_;
    std::timed_mutex mutex_;
    std::optional<Progress> progress_;
};

}  // namespace rapid
