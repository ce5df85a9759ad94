#include "bindings/run/statistics_file.h"

#include <utility>

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

void StatisticsFile::add(const FrameStatistics& frame) { waiting_.push_back(frame); }

void StatisticsFile::add_writing(std::int64_t frame, double seconds)
{
    for (FrameStatistics& waiting : waiting_)
        if (waiting.frame == frame) waiting.seconds.write += seconds;
}

void StatisticsFile::write_before(std::optional<std::int64_t> frame)
{
    while (!waiting_.empty() && (!frame || waiting_.front().frame < *frame)) {
        append(json_line(waiting_.front(), std::exchange(is_first_, false)));
        waiting_.pop_front();
    }
}

void StatisticsFile::finish(const RunStatistics& run)
{
    if (std::exchange(is_finished_, true)) return;
    write_before(std::nullopt);
    append(json_end(run));
    try {
        if (error_) throw Error(*error_);
        file_->finish();
    } catch (Error& error) {
        throw error.at({path_, 0});
    }
}

}  // namespace rapid
