// How an age grows by whole frames without drifting from their count.
//
// A float that grows by h each frame is rounded each time, always in the same direction while its exponent stays
// (0.4 ms after 2,000 frames of 1/24 s): it misses most whole numbers of frames, and a life of that length ends a frame
// late. Here an age is k h + j δ, with δ = h/2^m of two to four of the float's own steps: the float tells k and j
// exactly, and rounding never adds up. δ grows with the age; the sum of what an age that is no whole number of frames
// loses by that is below four of its last steps.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace rapid {

class Aging {
public:
    // h: the frame's length, s.
    explicit Aging(double h) : h_(h), per_h_(1 / h), finest_(std::ilogb(h) - 1 + 127 + 23) {}

    // An age one frame later, s. Written so that a loop over it becomes vectors.
    float after_frame(float age) const
    {
        const double sum = age + h_;
        // Of the coarser: what is known, or what is kept.
        const float larger = std::max(std::abs(age), std::abs(static_cast<float>(sum)));
        const auto exponent = static_cast<std::int32_t>(std::bit_cast<std::uint32_t>(larger) >> 23);
        const std::int32_t m = std::min(std::max(finest_ - std::max(exponent, 1), 0), most);
        return static_cast<float>(std::nearbyint(sum * per_h_ * power_of_2(m)) * power_of_2(-m) * h_);
    }

private:
    static constexpr std::int32_t most = 60;  // of steps that double can count; a younger age is rounded as any sum is

    static double power_of_2(std::int32_t m) { return std::bit_cast<double>(std::int64_t{m + 1023} << 52); }

    double h_, per_h_;
    std::int32_t finest_;  // m and the float's exponent together, where δ is two to four of its steps
};

}  // namespace rapid
