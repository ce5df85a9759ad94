#include "bindings/run/profile_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "runtime/json_text.h"
#include "runtime/report/frame_profile.h"

namespace rapid {
namespace {

constexpr int frames_row = 1, passes_row = 2, files_row = 3;  // "threads" of the trace

std::string row_name(int row, const std::string& name)
{
    JsonText json;
    json.object("name", "thread_name", "ph", "M", "pid", 1, "tid", row, "args", [&] { json.object("name", name); });
    return json.text();
}

// An event with a length, in µs.
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
    append(R"({"name":"process_name","ph":"M","pid":1,"args":{"name":"rapid"}})");
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

}  // namespace rapid
