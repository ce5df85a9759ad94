// Ages and deaths of points.
//
// An age must not drift from the frame count. A float that grows by h each frame is rounded each time, always in the
// same direction while its exponent stays (0.4 ms after 2,000 frames of 1/24 s). It misses most integer multiples of
// h, and a life of that length ends a frame late. Here an age is k h + j δ with integers k, j, and δ = h/2^m is two to
// four units in the last place: the float determines k and j exactly, and rounding never accumulates. δ grows with the
// age; in total, an age that is not a multiple of h loses less than four units in its last place.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "runtime/points/point_set.h"

namespace rapid {

class Aging {
public:
    // h: frame length, s.
    explicit Aging(double h) : h_(h), per_h_(1 / h), finest_(std::ilogb(h) - 1 + 127 + 23) {}

    // Returns an age one frame later, s. Branchless, so that a loop over it vectorizes.
    float after_frame(float age) const
    {
        const double sum = age + h_;
        // δ of the coarser of the two: the age given, and the age returned.
        const float larger = std::max(std::abs(age), std::abs(static_cast<float>(sum)));
        const auto exponent = static_cast<std::int32_t>(std::bit_cast<std::uint32_t>(larger) >> 23);
        const std::int32_t m = std::min(std::max(finest_ - std::max(exponent, 1), 0), most);
        return static_cast<float>(std::nearbyint(sum * per_h_ * power_of_2(m)) * power_of_2(-m) * h_);
    }

private:
    static constexpr std::int32_t most = 60;  // double cannot count the δ of younger ages, and rounds as usual

    static double power_of_2(std::int32_t m) { return std::bit_cast<double>(std::int64_t{m + 1023} << 52); }

    double h_, per_h_;
    std::int32_t finest_;  // m plus the biased exponent of the float, for δ of two to four units
};

// Advances the ages of the group's points by their `dt`, or by a frame, and removes points that have reached their
// `life`. Calls before_removal(stays) first; points to be removed have mask 0. Returns the number that died.
std::size_t age_points(PointSet& points, const std::string& group, double frame_length,
                       const std::function<void(std::span<const std::uint8_t>)>& before_removal);

}  // namespace rapid
