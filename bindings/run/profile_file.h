// The file of --profile: what each pass, frame and file took, in the trace format of Chrome, which the browser
// (chrome://tracing) and Perfetto open.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "runtime/error.h"
#include "runtime/files/output_file.h"
#include "runtime/graph/evaluate.h"
#include "runtime/io/frame_writer.h"

namespace rapid {

// Written while the run goes on. What fails is told at the end: the frames of the run are worth more.
class ProfileFile {
public:
    explicit ProfileFile(std::string path);

    void add(const FrameResult& result);
    void add(const FrameWriter::Written& file);

    // Ends the list and names the file; a second call does nothing. Error: it could not be written.
    void finish();

private:
    using Clock = std::chrono::steady_clock;
    double microseconds(Clock::time_point moment) const;
    void append(const std::string& event);

    const std::string path_;
    const Clock::time_point begin_ = Clock::now();
    std::optional<OutputFile> file_;
    std::optional<Error> error_;
    bool is_first_ = true, is_finished_ = false;
    std::vector<double> lanes_;  // µs, when the last file of each row of files was done: those of a row do not overlap
};

}  // namespace rapid
