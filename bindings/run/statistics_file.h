// The file of --stats, written while the run goes on: a run of many frames keeps none of them.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "runtime/error.h"
#include "runtime/files/output_file.h"
#include "runtime/report/statistics.h"

namespace rapid {

// What fails is told at the end: the frames of the run are worth more.
class StatisticsFile {
public:
    StatisticsFile(std::string path, const RunStatistics& run);

    // A frame waits for the time of writing its files, which come later.
    void add(const FrameStatistics& frame);
    void add_writing(std::int64_t frame, double seconds);
    // Writes the frames before this one, of whose files none is to come; all, where none is to come of any.
    void write_before(std::optional<std::int64_t> frame);

    // Writes all frames and the end, and names the file; a second call does nothing. Error: it could not be written.
    void finish(const RunStatistics& run);

private:
    void append(const std::string& text);

    const std::string path_;
    std::optional<OutputFile> file_;
    std::optional<Error> error_;
    std::deque<FrameStatistics> waiting_;
    bool is_first_ = true, is_finished_ = false;
};

}  // namespace rapid
