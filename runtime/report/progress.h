// Progress of a run: a bar that is redrawn on a terminal, a line for each frame elsewhere.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

namespace rapid {

enum class ProgressStyle { None, Lines, Bar };

// Bar if `out` is a terminal that can redraw a line.
ProgressStyle progress_style(std::FILE* out);

class Progress {
public:
    // The frames of the run, `last` included.
    Progress(std::FILE* out, ProgressStyle style, std::int64_t first, std::int64_t last);

    // Reports a computed frame and its points; now: time since the run began, s.
    void frame(std::int64_t number, std::uint64_t points, double now);

    // Prints a line of text above the bar.
    void line(const std::string& text);

    // Erases the bar.
    void finish();

private:
    void draw();
    void erase();

    std::FILE* out_;
    ProgressStyle style_;
    std::int64_t first_, last_;
    std::int64_t latest_ = 0;  // frame
    std::uint64_t points_ = 0;
    double now_ = 0, drawn_at_ = -1;
    double frame_seconds_ = 0;  // exponential moving average
    bool drawn_ = false;
};

// `[=======>            ] frame 12/48  20,000 points  3.21 million points/s  2.1 s left`, in at most `width` columns:
// the bar takes the space that the words leave, and words that do not fit are omitted from the right.
std::string progress_bar(std::int64_t frame, std::int64_t first, std::int64_t last, std::uint64_t points,
                         double points_per_second, double seconds_left, int width);

}  // namespace rapid
