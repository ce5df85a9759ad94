#include "runtime/solver/motion/ballistic_batch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "runtime/solver/motion/damped_motion.h"

namespace rapid {
namespace {

// a where all bits are set, b where none is.
float chosen(std::uint32_t bits, float a, float b)
{
    return std::bit_cast<float>((std::bit_cast<std::uint32_t>(a) & bits) | (std::bit_cast<std::uint32_t>(b) & ~bits));
}

// Points that are looked at, and then advanced, while they are in the first-level cache.
constexpr std::size_t block = 512;

constexpr auto nobody = [](std::uint32_t, bool) {};

}  // namespace

BallisticBatch::Period BallisticBatch::by_axis(const Vec3d& x)
{
    Period all;
    for (int l = 0; l < period; ++l) all[l] = x[l % 3];
    return all;
}

BallisticBatch::BallisticBatch(const Vec3d& g, double k) : g_(by_axis(g)), k_(k) {}

void BallisticBatch::set_times(Times& times, int point, double t) const
{
    const Propagator by = k_ == 0 ? Propagator() : respond(k_, 0, t);
    for (int l = 3 * point; l < 3 * point + 3; ++l) {
        times.t[l] = t;
        times.x_of_v[l] = by.x_of_v;
        times.v_of_v[l] = by.v_of_v;
        times.fallen[l] = by.x_of_G * g_[l];
        times.gained[l] = by.v_of_G * g_[l];
    }
}

BallisticBatch::Clock::Clock(const BallisticBatch& fall, const OwnTime& time, std::size_t begin)
    : fall_(fall), time_(time), own_(time.own.data && time.own.stride != 0 ? time.own.data : nullptr), of_h_(own_)
{
    for (int p = 0; p < points_a_period; ++p) fall_.set_times(times_, p, own_ ? time.h : time(begin));
}

void BallisticBatch::Clock::set(std::size_t first, std::size_t n)
{
    bool whole = true;
    for (std::size_t p = 0; p < n; ++p) whole &= own_[first + p] == static_cast<float>(time_.h);
    if (whole && of_h_) return;
    for (std::size_t p = 0; p < points_a_period; ++p) fall_.set_times(times_, p, time_(first + std::min(p, n - 1)));
    of_h_ = whole;
}

void BallisticBatch::avoid(const Box3d& box, double radius)
{
    const Vec3d margin = Vec3d::Constant(radius * (1 + 0x1p-21));
    boxes_.emplace_back(box.min() - margin, box.max() + margin);
    limits_.push_back({by_axis(boxes_.back().min()), by_axis(boxes_.back().max())});
}

// One period. near(p) is told, for each of its points, whether it stays; `largest`, by coordinate, keeps the size of
// what is written, unless that is known to be finite.
template <bool Dragged, bool Avoids, bool Checks, class Near>
void BallisticBatch::advance_period(float* P, float* v, const Times& times, std::uint32_t* largest,
                                    const Near& near) const
{
    float P1[period], v1[period];
    [[maybe_unused]] double lowest[period], highest[period];
    for (int l = 0; l < period; ++l) {
        const double x = P[l], u = v[l], t = times.t[l];
        double x1, u1, bend;  // how far the path is off the straight line at most
        if constexpr (Dragged) {
            x1 = x + (times.x_of_v[l] * u + times.fallen[l]);
            u1 = times.v_of_v[l] * u + times.gained[l];
            // The velocity goes from u to u1 and not back: a quarter of the difference, for t. And by as much as
            // another quarter of this are the parabolas of Collisions off the path.
            bend = 0.25 * (t * std::abs(u1 - u) + std::abs(times.fallen[l]));
        } else {
            const double gain = t * g_[l];
            x1 = x + t * (u + 0.5 * gain);
            u1 = u + gain;
            bend = std::abs(0.125 * t * gain);
        }
        P1[l] = static_cast<float>(x1);
        v1[l] = static_cast<float>(u1);
        if constexpr (Checks) largest[l] = std::max({largest[l], magnitude_bits(P1[l]), magnitude_bits(v1[l])});
        if constexpr (Avoids) {
            // The factor keeps a point that is flush with a box and rounded away from it.
            const double margin = bend + 0x1p-21 * std::abs(x);
            lowest[l] = std::min(x, x1) - margin;
            highest[l] = std::max(x, x1) + margin;
        }
    }
    if constexpr (!Avoids) {
        std::copy_n(P1, period, P);
        std::copy_n(v1, period, v);
        return;
    }

    double clear[points_a_period];
    std::fill_n(clear, points_a_period, std::numeric_limits<double>::infinity());
    for (const Limits& box : limits_) {
        double beyond[period];
        for (int l = 0; l < period; ++l) beyond[l] = std::max(box.least[l] - highest[l], lowest[l] - box.most[l]);
        for (int p = 0; p < points_a_period; ++p)
            clear[p] = std::min(clear[p], std::max(std::max(beyond[3 * p], beyond[3 * p + 1]), beyond[3 * p + 2]));
    }
    std::uint32_t goes[period];
    for (int p = 0; p < points_a_period; ++p) std::fill_n(goes + 3 * p, 3, clear[p] > 0 ? ~0u : 0u);
    for (int l = 0; l < period; ++l) {
        P[l] = chosen(goes[l], P1[l], P[l]);
        v[l] = chosen(goes[l], v1[l], v[l]);
    }
    for (int p = 0; p < points_a_period; ++p) near(p, !(clear[p] > 0));
}

BallisticBatch::Extent BallisticBatch::extent_of(std::span<const Vec3f> values)
{
    // Three vectors of eight are a period. They stay in registers.
    typedef float Lanes __attribute__((vector_size(32)));
    typedef std::int32_t Bits __attribute__((vector_size(32)));
    constexpr std::int32_t infinity = infinity_bits;
    const float* x = coordinates(values);
    const std::size_t size = 3 * values.size();
    float few[period];
    if (size < period) {
        for (std::size_t l = 0; l < period; ++l) few[l] = x[l % size];
        x = few;
    }
    const auto load = [&](std::size_t l) {
        Lanes some;
        std::memcpy(&some, x + l, sizeof some);
        return some;
    };
    Lanes least[3] = {load(0), load(8), load(16)}, most[3] = {least[0], least[1], least[2]};
    Bits largest[3] = {};
    const auto take = [&](std::size_t l) {
        for (int k = 0; k < 3; ++k) {
            const Lanes some = load(l + 8 * k);
            least[k] = some < least[k] ? some : least[k];
            most[k] = some > most[k] ? some : most[k];
            const Bits magnitude = std::bit_cast<Bits>(some) & 0x7fffffff;
            largest[k] = magnitude > largest[k] ? magnitude : largest[k];
        }
    };
    for (std::size_t l = 0; l + period < size; l += period) take(l);
    take(std::max<std::size_t>(size, period) - period);

    std::array<float, period> low, high;
    std::memcpy(&low, least, sizeof low);
    std::memcpy(&high, most, sizeof high);
    for (int half = period / 2; half >= 3; half /= 2)
        for (int l = 0; l < half; ++l) {
            low[l] = std::min(low[l], low[l + half]);
            high[l] = std::max(high[l], high[l + half]);
        }
    const Bits finite = (largest[0] < infinity) & (largest[1] < infinity) & (largest[2] < infinity);
    bool all = true;
    for (int l = 0; l < 8; ++l) all &= finite[l] != 0;
    return {Box3d(Vec3d(low[0], low[1], low[2]), Vec3d(high[0], high[1], high[2])), all};
}

// Whether no point of these places and velocities comes near a box in t seconds, and all stay finite.
bool BallisticBatch::are_far(const Box3d& places, const Box3d& speeds, double t) const
{
    const Vec3d g = Eigen::Map<const Vec3d>(g_.data()), pulled = t * g;
    // Drag makes less of the velocity and of what the acceleration adds, each by itself.
    const Vec3d slowest = k_ == 0 ? Vec3d(speeds.min().cwiseMin(speeds.min() + pulled).cwiseMin(0.0))
                                  : Vec3d(speeds.min().cwiseMin(0.0) + pulled.cwiseMin(0.0));
    const Vec3d fastest = k_ == 0 ? Vec3d(speeds.max().cwiseMax(speeds.max() + pulled).cwiseMax(0.0))
                                  : Vec3d(speeds.max().cwiseMax(0.0) + pulled.cwiseMax(0.0));
    const Vec3d rounding = 0x1p-20 * places.min().cwiseAbs().cwiseMax(places.max().cwiseAbs());
    const Box3d reach(places.min() + t * slowest - rounding, places.max() + t * fastest + rounding);
    static constexpr double most = std::numeric_limits<float>::max() / 2;
    const auto is_finite = [](const Vec3d& least, const Vec3d& greatest) {
        return (least.array() > -most).all() && (greatest.array() < most).all();
    };
    return is_finite(reach.min(), reach.max()) && is_finite(slowest, fastest) &&
           std::none_of(boxes_.begin(), boxes_.end(), [&](const Box3d& box) { return box.intersects(reach); });
}

BallisticBatch::Progress BallisticBatch::advance(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time,
                                                 std::size_t begin, std::size_t end,
                                                 std::vector<std::uint32_t>& near) const
{
    if (limits_.empty()) return advance_any<false>(P, v, time, begin, end, near);
    return advance_any<true>(P, v, time, begin, end, near);
}

template <bool Avoids>
BallisticBatch::Progress BallisticBatch::advance_any(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time,
                                                     std::size_t begin, std::size_t end,
                                                     std::vector<std::uint32_t>& near) const
{
    return k_ == 0 ? advance_all<false, Avoids>(P, v, time, begin, end, near)
                   : advance_all<true, Avoids>(P, v, time, begin, end, near);
}

template <bool Dragged, bool Avoids>
BallisticBatch::Progress BallisticBatch::advance_all(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time,
                                                     std::size_t begin, std::size_t end,
                                                     std::vector<std::uint32_t>& near) const
{
    const double longest = std::max(time.h, double(static_cast<float>(time.h)));
    Clock clock(*this, time, begin);
    std::uint32_t largest[period] = {};
    for (std::size_t at = begin; at < end; at += block) {
        const std::size_t size = std::min(block, end - at);
        if constexpr (!Avoids) {
            if (!all_finite(P.subspan(at, size)) || !all_finite(v.subspan(at, size))) return progress(at, largest);
            advance_block<Dragged, false, true>(P, v, clock, at, at + size, largest, nobody);
        } else {
            const Extent places = extent_of(P.subspan(at, size)), speeds = extent_of(v.subspan(at, size));
            if (!places.finite || !speeds.finite) return progress(at, largest);
            if (are_far(places.box, speeds.box, longest)) {
                advance_block<Dragged, false, false>(P, v, clock, at, at + size, largest, nobody);
                continue;
            }
            std::size_t count = near.size();
            near.resize(count + size + points_a_period);
            advance_block<Dragged, true, true>(P, v, clock, at, at + size, largest, [&](std::uint32_t i, bool stays) {
                near[count] = i;
                count += stays && i < end;
            });
            near.resize(count);
        }
    }
    return progress(end, largest);
}

BallisticBatch::Progress BallisticBatch::progress(std::size_t end, const std::uint32_t* largest)
{
    return {end, *std::max_element(largest, largest + period) < infinity_bits};
}

template <bool Dragged, bool Avoids, bool Checks, class Near>
void BallisticBatch::advance_block(std::span<Vec3f> P, std::span<Vec3f> v, Clock& clock, std::size_t begin,
                                   std::size_t end, std::uint32_t* largest, const Near& near) const
{
    std::uint32_t own_largest[period];
    std::copy_n(largest, period, own_largest);
    for (std::size_t at = begin; at < end; at += points_a_period) {
        // What the next block will look at is fetched while this one is computed.
        for (int line = 0; line < 2; ++line) {
            __builtin_prefetch(P.data()->data() + 3 * (at + block) + 16 * line);
            __builtin_prefetch(v.data()->data() + 3 * (at + block) + 16 * line);
        }
        const std::size_t n = std::min<std::size_t>(points_a_period, end - at);
        const Times& times = clock.of(at, n);
        float *P_some = P[at].data(), *v_some = v[at].data(), P_end[period] = {}, v_end[period] = {};
        if (n < points_a_period) {
            P_some = std::copy_n(P_some, 3 * n, P_end) - 3 * n;
            v_some = std::copy_n(v_some, 3 * n, v_end) - 3 * n;
        }
        advance_period<Dragged, Avoids, Checks>(P_some, v_some, times, own_largest, [&](int p, bool stays) {
            near(static_cast<std::uint32_t>(at + p), stays);
        });
        if (n < points_a_period) {
            std::copy_n(P_end, 3 * n, P[at].data());
            std::copy_n(v_end, 3 * n, v[at].data());
        }
    }
    std::copy_n(own_largest, period, largest);
}

}  // namespace rapid
