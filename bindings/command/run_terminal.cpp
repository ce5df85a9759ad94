#include "bindings/command/run_terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <utility>

#include "bindings/scene/scene_inside.h"
#include "runtime/files/output_file.h"

namespace rapid {

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

}  // namespace rapid
