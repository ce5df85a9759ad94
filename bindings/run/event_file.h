// The events of a run, as points in a file: --events.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "runtime/files/frame_archive.h"
#include "runtime/graph/evaluate.h"
#include "runtime/io/point_file.h"

namespace rapid {

class EventFile {
public:
    // path: empty where nobody asks for it.
    explicit EventFile(std::string path) : path_(std::move(path)) {}

    const std::string& path() const { return path_; }
    // Before the first frame. Error: no format that can be one file of points; a file that can't be written.
    void begin();

    // The events of a frame, in the order of their times.
    void add(const FrameResult& result);
    // Names the file, which there is not before.
    void finish();

    // From now on events go to this file, too, from which another run takes them up. Error: it can't be opened.
    void log_to(const std::filesystem::path& log);
    // How far the log is, in bytes; nothing where there is none, or not any more.
    std::optional<std::uint64_t> logged() const;
    // Why there is none any more, once.
    std::string take_failure() { return std::exchange(failure_, {}); }
    // Error: what the log has up to there is not whole.
    void check_log(std::uint64_t bytes) const;
    // The events so far are those of the log up to there; it goes on behind them.
    void go_on_behind(std::uint64_t bytes);

private:
    void check() const;
    // Calls f with the events of each record of the log up to there. Throws Error if the log is not whole.
    template <class F>
    void read_log(std::uint64_t bytes, const F& f) const;

    std::string path_;
    std::optional<PointFile> file_;
    std::filesystem::path log_path_;
    std::optional<RecordLog> log_;
    std::string failure_;
};

}  // namespace rapid
