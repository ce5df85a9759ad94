#include "bindings/run/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "runtime/report/memory.h"

namespace rapid {

RunReport::RunReport(Options options, Listener listener, FrameFiles& files, RunCache* cache)
    : listener_(std::move(listener)), files_(files), cache_(cache)
{
    run_.graph = std::move(options.graph);
    run_.threads = options.threads;
    if (!options.stats_file.empty()) statistics_.emplace(std::move(options.stats_file), run_);
    if (!options.profile_file.empty()) profile_.emplace(std::move(options.profile_file));
}

std::unique_lock<std::timed_mutex> RunReport::locked()
{
    std::unique_lock lock(mutex_);
    while (is_abandoned_) {
        lock.unlock();
        std::this_thread::sleep_for(std::chrono::seconds(1));  // the process is about to end
        lock.lock();
    }
    return lock;
}

double RunReport::now() const { return earlier_seconds_ + stopwatch_.seconds(); }

void RunReport::frame(const FrameResult& result)
{
    const auto lock = locked();
    const FrameStatistics frame = statistics_of(result);
    totals_.add(frame);
    if (statistics_) statistics_->add(frame);
    if (profile_) profile_->add(result);
    if (cache_) cache_->computed(frame, result.figures.stiff);
    add_writing();
    keep_worst(run_.stiff, result.figures.stiff);
    listener_.frame(frame, now(), false);
}

void RunReport::known_frame(const FrameRecord& record, bool is_before)
{
    const auto lock = locked();
    totals_.add(record.statistics);
    if (statistics_) statistics_->add(record.statistics);
    keep_worst(run_.stiff, record.stiff);
    for (const std::string& text : record.warnings) tell(text, record.statistics.frame);
    if (is_before) {
        earlier_seconds_ = std::max(earlier_seconds_, record.seconds);
        earlier_peak_ = std::max(earlier_peak_, record.peak_bytes);
    }
    listener_.frame(record.statistics, now(), true);
}

void RunReport::line(const std::string& text)
{
    const auto lock = locked();
    listener_.line(text);
}

void RunReport::warning(const std::string& text)
{
    const auto lock = locked();
    if (warned_.insert(text).second) listener_.warning(text);
}

void RunReport::warning(const std::string& text, std::int64_t frame)
{
    const auto lock = locked();
    if (cache_) cache_->warned(text);
    tell(text, frame);
}

void RunReport::tell(const std::string& text, std::int64_t frame)
{
    if (warned_.contains(text) || !frame_warnings_.add(text, frame)) return;
    listener_.warning(fmt::format("frame {}: {}", frame, text));
}

void RunReport::tell_untold()
{
    for (const std::string& text : std::exchange(frame_warnings_, {}).untold()) listener_.warning(text);
}

std::string RunReport::finish()
{
    const auto lock = locked();
    tell_untold();
    write_statistics();
    return summary(run_, totals_);
}

std::string RunReport::finish_early()
{
    const auto lock = locked();
    tell_untold();
    return try_to_write();
}

std::optional<RunReport::Abandoned> RunReport::abandon()
{
    // The run's own thread holds the lock only briefly, unless the program does not return from what it is told.
    const std::unique_lock lock(mutex_, std::chrono::seconds(1));
    if (!lock) return std::nullopt;
    is_abandoned_ = true;
    return Abandoned{frame_warnings_.untold(), try_to_write()};
}

std::string RunReport::try_to_write()
{
    try {
        write_statistics();
        return {};
    } catch (const std::exception& error) {
        return error.what();
    }
}

void RunReport::add_writing()
{
    const std::optional<std::int64_t> unwritten = files_.first_unwritten();  // first: files of frames before are taken
    for (const FrameFiles::Written& file : files_.take_written()) {
        totals_.add_writing(file.seconds);
        if (statistics_) statistics_->add_writing(file.frame, file.seconds);
        if (profile_) profile_->add(file);
        if (cache_) cache_->written(file);
    }
    if (cache_) cache_->complete_before(unwritten, now(), std::max(earlier_peak_, peak_memory()));
    if (statistics_) statistics_->write_before(unwritten);
}

void RunReport::write_statistics()
{
    run_.seconds = now();
    run_.peak_bytes = std::max(earlier_peak_, peak_memory());
    add_writing();
    std::optional<Error> failed;
    try {
        if (profile_) profile_->finish();
    } catch (const Error& error) {
        failed = error;
    }
    if (statistics_) statistics_->finish(run_);
    if (failed) throw Error(*failed);
}

}  // namespace rapid
