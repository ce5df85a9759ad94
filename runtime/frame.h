// Frames and their times.
#pragma once

#include <cstdint>

namespace rapid {

// The instant that a parameter, kernel, node or motion is asked for. time = (number - start) / fps, dt = 1 / fps, from
// the frame's number, never from a sum.
struct Frame {
    double number = 1;  // whole except where a motion is asked between frames
    double time = 0;    // s
    double dt = 0;      // s
};

// Which time a simulation's frames have.
struct FrameClock {
    double fps = 24;
    std::int64_t start = 1;  // the frame at time 0

    Frame at(double number) const { return {number, (number - static_cast<double>(start)) / fps, 1 / fps}; }
};

}  // namespace rapid
