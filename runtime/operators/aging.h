// How an age grows by whole frames without drifting from their count.
//
// A float that grows by h each frame is rounded each time, always in the same direction while its exponent stays
// (0.4 ms after 2,000 frames of 1/24 s): it misses most whole numbers of frames, and a life of that length ends a frame
// late. Here an age is k h + j δ, with δ = h/2^m of two to four of the float's own steps: the float tells k and j
// exactly, and rounding never adds up. δ grows with the age; the sum of what an age that is no whole number of frames
// loses by that is below four of its last steps.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace rapid {

class Aging {
public:
    // h: the frame's length, s.
    explicit Aging(double h) : h_(h)
    {
        for (int exponent = 0; exponent < 256; ++exponent) {
            const double step = std::ldexp(1.0, std::max(exponent, 1) - 127 - 23);
            const int m = std::ilogb(h / (2 * step));
            steps_a_frame_[static_cast<std::size_t>(exponent)] = std::ldexp(1.0, std::clamp(m, 0, most_));
        }
    }

    // An age one frame later, s.
    float after_frame(float age) const
    {
        const double sum = age + h_;
        // Of the coarser: what is known, or what is kept.
        const float larger = std::max(std::abs(age), std::abs(static_cast<float>(sum)));
        const auto exponent = std::bit_cast<std::uint32_t>(larger) >> 23;
        const double steps = steps_a_frame_[exponent];
        return static_cast<float>(std::nearbyint(sum / h_ * steps) / steps * h_);
    }

private:
    static constexpr int most_ = 60;  // of steps that double can count; a younger age is rounded as any sum is

    double h_;
    std::array<double, 256> steps_a_frame_;  // h/δ by the float's exponent
};

}  // namespace rapid
