// How far a run is: a bar that is redrawn on a terminal, a line a frame elsewhere.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

#include "runtime/report/statistics.h"

namespace rapid {

enum class ProgressStyle { None, Lines, Bar };

// Bar where `out` is a terminal that can be redrawn.
ProgressStyle progress_style(std::FILE* out);

class Progress {
public:
    // The frames of the run, last included.
    Progress(std::FILE* out, ProgressStyle style, std::int64_t first, std::int64_t last);

    // A frame is computed; `now` is the time since the run began, s.
    void frame(const FrameStatistics& frame, double now);

    // A line of text, above the bar.
    void line(const std::string& text);

    // Takes the bar away.
    void finish();

private:
    void draw();
    void erase();

    std::FILE* out_;
    ProgressStyle style_;
    std::int64_t first_, last_;
    FrameStatistics latest_;
    double now_ = 0, drawn_at_ = -1;
    double frame_seconds_ = 0;  // of late: a mean that forgets
    bool drawn_ = false;
};

// `[=======>            ] frame 12/48  20,000 points  3.21 million points/s  2.1 s left`, in at most `width` columns:
// the bar gets what the words leave, and what does not fit is left out from the right.
std::string progress_bar(std::int64_t frame, std::int64_t first, std::int64_t last, std::uint64_t points,
                         double points_per_second, double seconds_left, int width);

}  // namespace rapid
