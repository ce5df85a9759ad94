// How many points an emitter bears in a frame, and when.
//
// A constant rate r has borne floor(r t) points by the time t = n / fps, computed from the whole number n of frames,
// never from a sum of steps: no birth is lost or doubled at a frame's end, however long the run. Where the rate
// changes, the fraction of a birth that is due goes over to the new rate. A birth on a frame's end belongs to that
// frame.
#pragma once

#include <cstddef>
#include <cstdint>

namespace rapid {

// The births of one frame, or of a part of it. They are numbered over the emitter's whole life, from 0.
struct Births {
    std::uint64_t first = 0;
    std::size_t count = 0;

    // "even": evenly spaced in time, the birth i of this frame (from 0) being the due one when i + 1 of `reached` are.
    double reached = 0;     // births due since the frame's beginning, at its end; not whole
    double per_second = 0;  // 1/s
    // Seconds from birth i to the frame's end, at least 0.
    double even_age(std::size_t i) const;
};

class BirthClock {
public:
    // No births before the end of the frame `start`.
    explicit BirthClock(std::int64_t start = 1) : anchor_(start) {}

    // The births of `frame` at `rate` (1/s, finite, at least 0). Called for the frames in their order.
    Births at_rate(double rate, std::int64_t frame, double fps);
    // Of `count` births in a frame, however many others have, those of its part number `part`, from 0, of so many.
    Births at_once(std::size_t count, double fps, int part = 0, int parts = 1);

private:
    double due(std::int64_t frame, double fps) const;

    std::uint64_t total_ = 0;  // births of the emitter
    double rate_ = 0;          // 1/s
    std::int64_t anchor_;      // frame at whose end this rate began
    double carry_ = 0;         // births due at the anchor that were not borne yet, in [0, 1)
    std::uint64_t borne_ = 0;  // births since the anchor
};

}  // namespace rapid
