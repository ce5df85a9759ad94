// Frames and their times.
#pragma once

#include <cmath>
#include <cstdint>

namespace rapid {

// The time at which a parameter, kernel, node or motion is evaluated. time = (number - start) / fps and dt = 1 / fps
// (or a sub-frame's share of it) are computed from the frame's number, never accumulated.
struct Frame {
    double number = 1;  // an integer, except for a motion between frames
    double time = 0;    // s
    double dt = 0;      // s
};

// The times of a simulation's frames and steps. A frame has `subframes` steps, each of which evaluates the whole graph.
// Steps are counted from `start`, so that with one step per frame their numbers equal the frames'.
struct FrameClock {
    double fps = 24;
    std::int64_t start = 1;  // number of the frame and the step at time 0
    int subframes = 1;

    double steps_per_second() const { return fps * subframes; }
    Frame at(double number) const
    {
        return {number, (number - static_cast<double>(start)) / fps, 1 / steps_per_second()};
    }
    // Returns the end of a step. Its time is computed from the number of whole steps.
    Frame at_step(std::int64_t step) const
    {
        const auto passed = static_cast<double>(step - start);
        return {static_cast<double>(start) + passed / subframes, passed / steps_per_second(), 1 / steps_per_second()};
    }
    std::int64_t step_at(const Frame& frame) const
    {
        return start + std::llround((frame.number - static_cast<double>(start)) * subframes);
    }
    // Returns the step at the end of a frame.
    std::int64_t step_of(std::int64_t frame) const { return start + (frame - start) * subframes; }
    bool is_whole(std::int64_t step) const { return (step - start) % subframes == 0; }
};

}  // namespace rapid
