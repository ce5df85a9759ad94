// Writes the events of a run as points in a file: --events.
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
    // path: empty if events are not requested.
    explicit EventFile(std::string path) : path_(std::move(path)) {}

    const std::string& path() const { return path_; }
    // Called before the first frame. Throws Error if the format cannot be a single file of points, or the file cannot
    // be written.
    void begin();

    // Adds the events of a frame, in the order of their times.
    void add(const FrameResult& result);
    // Gives the file its name, which does not exist before.
    void finish();

    // Also writes events to this log from now on, for a later run to continue. Throws Error if it cannot be opened.
    void log_to(const std::filesystem::path& log);
    // Returns the length of the log in bytes; nothing if there is no log, or no longer one.
    std::optional<std::uint64_t> logged() const;
    // Returns why the log has stopped, once.
    std::string take_failure() { return std::exchange(failure_, {}); }
    // Throws Error if the log is not complete up to there.
    void check_log(std::uint64_t bytes) const;
    // Takes the events from the log up to there, and continues after them.
    void continue_after(std::uint64_t bytes);

private:
    void check() const;
    // Calls f with the events of each record of the log up to there. Throws Error if the log is not complete.
    template <class F>
    void read_log(std::uint64_t bytes, const F& f) const;

    std::string path_;
    std::optional<PointFile> file_;
    std::filesystem::path log_path_;
    std::optional<RecordLog> log_;
    std::string failure_;
};

}  // namespace rapid
