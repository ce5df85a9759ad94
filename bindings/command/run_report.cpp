#include "bindings/command/run_report.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "runtime/files/output_file.h"
#include "runtime/report/memory.h"

namespace rapid {

RunReport::RunReport(Options options, FrameFiles& files) : options_(std::move(options)), files_(files)
{
    run_.graph = options_.graph;
    run_.threads = options_.threads;
    if (!options_.stats_file.empty()) statistics_.emplace(options_.stats_file, run_);
    if (!options_.profile_file.empty()) profile_.emplace(options_.profile_file);
}

double RunReport::now() const { return earlier_seconds_ + stopwatch_.seconds(); }

void RunReport::begin(std::int64_t first, std::int64_t last)
{
    const std::lock_guard lock(mutex_);
    progress_.emplace(stdout, options_.quiet ? ProgressStyle::None : progress_style(stdout), first, last);
}

void RunReport::frame(const FrameResult& result)
{
    const std::lock_guard lock(mutex_);
    const FrameStatistics frame = statistics_of(result);
    totals_.add(frame);
    if (statistics_) statistics_->add(frame);
    if (profile_) profile_->add(result);
    if (cache_) cache_->computed(frame, result.figures.stiff);
    add_writing();
    keep_worst(run_.stiff, result.figures.stiff);
    progress_->frame(frame, now());
}

void RunReport::known_frame(const FrameRecord& record, bool is_before)
{
    const std::lock_guard lock(mutex_);
    totals_.add(record.statistics);
    if (statistics_) statistics_->add(record.statistics);
    keep_worst(run_.stiff, record.stiff);
    for (const std::string& text : record.warnings) tell(text, record.statistics.frame);
    if (!is_before) return;
    earlier_seconds_ = std::max(earlier_seconds_, record.seconds);
    earlier_peak_ = std::max(earlier_peak_, record.peak_bytes);
}

void RunReport::line(const std::string& text)
{
    const std::lock_guard lock(mutex_);
    progress_->line(text);
}

void RunReport::warning(const std::string& text)
{
    const std::lock_guard lock(mutex_);
    if (!warned_.insert(text).second) return;
    if (progress_) progress_->finish();
    print_warning(text);
}

void RunReport::warning(const std::string& text, std::int64_t frame)
{
    const std::lock_guard lock(mutex_);
    if (cache_) cache_->warned(text);
    tell(text, frame);
}

void RunReport::tell(const std::string& text, std::int64_t frame)
{
    if (warned_.contains(text) || !frame_warnings_.add(text, frame)) return;
    if (progress_) progress_->finish();
    print_warning(fmt::format("frame {}: {}", frame, text));
}

void RunReport::finish()
{
    const std::lock_guard lock(mutex_);
    if (progress_) progress_->finish();
    tell_untold();
    write_statistics();
    if (options_.quiet) return;
    print(summary(run_, totals_));
}

int RunReport::fail(const Error& error) { return end_early(status_failed, error); }

int RunReport::interrupted(int signal, const std::string& why) { return end_early(128 + signal, Error(why)); }

int RunReport::end_early(int status, const Error& error)
{
    const std::lock_guard lock(mutex_);
    if (progress_) progress_->finish();
    tell_untold();
    print_error(error, options_.verbose);
    try {
        write_statistics();
    } catch (const Error& second) {
        print_error(second, options_.verbose);
    }
    return status;
}

void RunReport::abandon(int status, const std::string& why)
{
    // The run's own thread holds the lock only briefly, unless its terminal is stopped; then do without it.
    if (mutex_.try_lock_for(std::chrono::seconds(1))) {
        if (progress_) progress_->finish();
        tell_untold();
        print_error(Error(why), false);
        try {
            write_statistics();
        } catch (const Error& error) {
            print_error(error, false);
        }
    }
    remove_unfinished_files();
    _exit(status);
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

void RunReport::tell_untold()
{
    for (const std::string& line : frame_warnings_.untold()) print_warning(line);
}

}  // namespace rapid
