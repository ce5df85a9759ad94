#include "bindings/run/run_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "runtime/base/json.h"
#include "runtime/report/frame_profile.h"
#include "runtime/report/memory.h"
#include "runtime/solver/estimate/stiffness.h"

namespace rapid {

StatisticsFile::StatisticsFile(std::string path, const RunStatistics& run) : path_(std::move(path))
{
    try {
        file_.emplace(path_);
    } catch (const Error& error) {
        error_ = error;
    }
    append(json_head(run));
}

void StatisticsFile::append(const std::string& text)
{
    if (error_) return;
    try {
        file_->append(text.data(), text.size());
    } catch (const Error& error) {
        error_ = error;
    }
}

void StatisticsFile::add(const FrameFigures& frame) { waiting_.push_back(frame); }

void StatisticsFile::add_writing(std::int64_t frame, double seconds)
{
    for (FrameFigures& waiting : waiting_)
        if (waiting.frame == frame) waiting.seconds.write += seconds;
}

void StatisticsFile::write_before(std::optional<std::int64_t> frame, const ErrorSources& errors)
{
    while (!waiting_.empty() && (!frame || waiting_.front().frame < *frame)) {
        append(json_line(waiting_.front(), std::exchange(is_first_, false), &errors));
        waiting_.pop_front();
    }
}

void StatisticsFile::finish(const RunStatistics& run)
{
    if (std::exchange(is_finished_, true)) return;
    write_before(std::nullopt, run.errors);
    append(json_end(run));
    try {
        if (error_) throw Error(*error_);
        file_->finish();
    } catch (Error& error) {
        throw error.at({path_, 0});
    }
}

namespace {

constexpr int frames_row = 1, passes_row = 2, files_row = 3;  // "threads" of the trace

std::string row_name(int row, const std::string& name)
{
    JsonText json;
    json.object("name", "thread_name", "ph", "M", "pid", 1, "tid", row, "args", [&] { json.object("name", name); });
    return json.text();
}

// Returns an event with a duration, in µs.
std::string complete(const std::string& name, const char* category, int row, double begin, double length,
                     const auto&... args)
{
    JsonText json;
    json.object("name", name, "cat", category, "ph", "X", "pid", 1, "tid", row, "ts", begin, "dur", length, "args",
                [&] { json.object(args...); });
    return json.text();
}

double rate(std::uint64_t count, double seconds) { return seconds > 0 ? static_cast<double>(count) / seconds : 0; }

}  // namespace

ProfileFile::ProfileFile(std::string path) : path_(std::move(path))
{
    try {
        file_.emplace(path_);
        const std::string head = "{\"displayTimeUnit\": \"ms\", \"traceEvents\": [";
        file_->append(head.data(), head.size());
    } catch (const Error& error) {
        error_ = error;
    }
    JsonText process;
    process.object("name", "process_name", "ph", "M", "pid", 1, "args", [&] { process.object("name", "rapid"); });
    append(process.text());
    append(row_name(frames_row, "frames"));
    append(row_name(passes_row, "nodes"));
}

double ProfileFile::microseconds(Clock::time_point moment) const
{
    return std::chrono::duration<double, std::micro>(moment - begin_).count();
}

void ProfileFile::append(const std::string& event)
{
    if (error_) return;
    try {
        const std::string text = (std::exchange(is_first_, false) ? "\n" : ",\n") + event;
        file_->append(text.data(), text.size());
    } catch (const Error& error) {
        error_ = error;
    }
}

void ProfileFile::add(const FrameResult& result)
{
    const double begin = microseconds(result.began);
    std::uint64_t points = 0, bytes = 0;
    for (const auto& [name, set] : result.outputs) points += set.size(), bytes += set.bytes();
    append(complete(fmt::format("frame {}", result.frame), "frame", frames_row, begin, 1e6 * result.total_seconds,
                    "frame", result.frame, "points", points, "bytes", bytes, "points_per_second",
                    rate(points, result.total_seconds), "substeps", result.figures.substeps, "collisions",
                    result.figures.collisions));
    for (const NodeWork& work : result.work)
        append(complete(fmt::format("{}", fmt::join(work.nodes, " + ")), name_of(work.stage), passes_row,
                        begin + 1e6 * work.begin, 1e6 * work.seconds, "frame", result.frame, "nodes", work.nodes,
                        "points", work.points, "bytes", work.bytes, "points_per_second",
                        rate(work.points, work.seconds)));
    for (const auto& [name, value] : {std::pair("points", points), std::pair("bytes of points", bytes)}) {
        JsonText json;
        json.object("name", name, "ph", "C", "pid", 1, "ts", begin, "args",
                    [&, all = value] { json.object("all outputs", all); });
        append(json.text());
    }
}

void ProfileFile::add(const FrameWriter::Written& file)
{
    const double end = microseconds(file.end), begin = end - 1e6 * file.seconds;
    auto lane = std::find_if(lanes_.begin(), lanes_.end(), [&](double last) { return last <= begin; });
    const int row = files_row + static_cast<int>(lane - lanes_.begin());
    if (lane == lanes_.end()) {
        lane = lanes_.insert(lane, end);
        append(row_name(row, lanes_.size() == 1 ? "files" : fmt::format("files {}", lanes_.size())));
    }
    *lane = end;
    append(complete("write " + file.path, "write", row, begin, 1e6 * file.seconds, "frame", file.frame, "bytes",
                    file.bytes));
}

void ProfileFile::finish()
{
    if (std::exchange(is_finished_, true)) return;
    try {
        if (error_) throw Error(*error_);
        const std::string end = "\n]}\n";
        file_->append(end.data(), end.size());
        file_->finish();
    } catch (Error& error) {
        throw error.at({path_, 0});
    }
}

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
    const FrameFigures frame = statistics_of(result);
    totals_.add(frame);
    if (statistics_) statistics_->add(frame);
    if (profile_) profile_->add(result);
    if (cache_) cache_->computed(frame);
    add_writing();
    keep_worst(run_.stiff, result.figures.stiff);
    listener_.frame(frame, now(), false);
}

void RunReport::known_frame(const FrameRecord& record, bool is_before)
{
    const auto lock = locked();
    totals_.add(record.statistics);
    for (const WrittenFile& file : record.files) totals_.add_file(file.path, false, record.statistics.points, 0);
    if (statistics_) statistics_->add(record.statistics);
    keep_worst(run_.stiff, record.statistics.stiff);
    for (const std::string& text : record.warnings) report_warning(text, record.statistics.frame);
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
    if (!warned_.insert(text).second) return;
    ++totals_.warnings;
    listener_.warning(text);
}

void RunReport::warning(const std::string& text, std::int64_t frame)
{
    const auto lock = locked();
    if (cache_) cache_->warned(text);
    report_warning(text, frame);
}

void RunReport::report_warning(const std::string& text, std::int64_t frame)
{
    if (warned_.contains(text) || !frame_warnings_.add(text, frame)) return;
    ++totals_.warnings;
    listener_.warning(fmt::format("frame {}: {}", frame, text));
}

void RunReport::report_suppressed()
{
    for (const std::string& text : std::exchange(frame_warnings_, {}).suppressed()) listener_.warning(text);
}

std::string RunReport::finish()
{
    const auto lock = locked();
    report_suppressed();
    write_statistics();
    return summary(run_, totals_);
}

std::string RunReport::finish_early()
{
    const auto lock = locked();
    report_suppressed();
    return try_to_write();
}

std::optional<RunReport::Abandoned> RunReport::abandon()
{
    // The run's own thread holds the lock only briefly, unless a callback of the program does not return.
    const std::unique_lock lock(mutex_, std::chrono::seconds(1));
    if (!lock) return std::nullopt;
    is_abandoned_ = true;
    return Abandoned{frame_warnings_.suppressed(), try_to_write()};
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
        totals_.add_file(file.path, file.film, file.points, file.seconds);
        if (statistics_) statistics_->add_writing(file.frame, file.seconds);
        if (profile_) profile_->add(file);
        if (cache_) cache_->written(file);
    }
    if (cache_) cache_->complete_before(unwritten, now(), std::max(earlier_peak_, peak_memory()));
    if (statistics_) statistics_->write_before(unwritten, run_.errors);
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
