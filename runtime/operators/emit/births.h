// How many points an emitter emits in a frame, and when.
//
// By the time t = n / fps a constant rate r has emitted floor(r t) points, computed from the whole number n of frames
// and never from a sum of steps: no birth is lost or doubled at the end of a frame, however long the run. When the rate
// changes, the fraction of a birth that is due carries over to the new rate. A birth at the end of a frame belongs to
// that frame.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "runtime/points/state_archive.h"

namespace rapid {

// A number of births due that is this near to a whole one counts as that. 0.29 births a second for 100 s are
// 28.999999999999996 in doubles, and 29 to the user. Rounding stays below 1e-11 after 100,000 changes of the rate, and
// a birth is shifted by at most this fraction of the interval between two.
inline constexpr double whole_tolerance = 1e-9;

// Of a newborn point with the attributes that most have, in the state and in what is made of it within a frame.
inline constexpr double bytes_a_birth = 2 * 64;

// The number of births at a frame. impulse: numbers of births by frame.
template <class Numbers>
std::size_t impulse_at(const Numbers& impulse, std::int64_t frame)
{
    const auto found = impulse.find(frame);
    return found == impulse.end() ? 0 : static_cast<std::size_t>(found->second);
}

// Whether a frame up to this one has an impulse: a trial skips frames (Evaluator::examine).
template <class Numbers>
bool has_impulse_by(const Numbers& impulse, double frame)
{
    return !impulse.empty() && static_cast<double>(impulse.begin()->first) <= frame;
}

// The births of one frame, or of a part of it, numbered from 0 over the emitter's whole life.
struct Births {
    std::uint64_t first = 0;
    std::size_t count = 0;

    // Evenly spaced births: birth i of this frame, from 0, takes place when i + 1 births are due.
    double due = 0;         // births due at the frame's end since its beginning; not whole
    double per_second = 0;  // rate, 1/s
    // Time from birth i to the frame's end, s, at least 0.
    double even_age(std::size_t i) const;
};

class BirthClock {
public:
    // No births before the end of the frame `start`.
    explicit BirthClock(std::int64_t start = 1) : anchor_(start) {}

    // The births of `frame` at `rate` (1/s, finite, at least 0). Called for the frames in their order.
    Births at_rate(double rate, std::int64_t frame, double fps);
    // Of the `count` births of a frame, those of its part number `part`, from 0, of `parts`.
    Births at_once(std::size_t count, double fps, int part = 0, int parts = 1);

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(total_, rate_, anchor_, carry_, born_);
        if constexpr (Archive::is_loading::value)
            StateReader::expect(total_ <= most_births && born_ <= total_ && rate_ >= 0 && std::isfinite(rate_) &&
                                std::isfinite(carry_) && std::abs(anchor_) <= most_births);
    }

private:
    static constexpr std::int64_t most_births = std::int64_t{1} << 53;  // and frames, as doubles count

    double due_by(std::int64_t frame, double fps) const;

    std::uint64_t total_ = 0;  // births so far
    double rate_ = 0;          // 1/s
    std::int64_t anchor_;      // frame at whose end this rate began
    double carry_ = 0;         // fraction of a birth due at the anchor, in [0, 1)
    std::uint64_t born_ = 0;   // births since the anchor
};

}  // namespace rapid
