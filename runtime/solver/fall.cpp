#include "runtime/solver/fall.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "runtime/solver/damped_motion.h"

namespace rapid {
namespace {

// a where all bits are set, b where none is.
float chosen(std::uint32_t bits, float a, float b)
{
    return std::bit_cast<float>((std::bit_cast<std::uint32_t>(a) & bits) | (std::bit_cast<std::uint32_t>(b) & ~bits));
}

// Points that are looked at, and then advanced, while they are in the first-level cache.
constexpr std::size_t block = 256;

}  // namespace

Fall::Period Fall::by_axis(const Vec3d& x)
{
    Period all;
    for (int l = 0; l < period; ++l) all[l] = x[l % 3];
    return all;
}

Fall::Fall(const Vec3d& g, double k) : g_(by_axis(g)), k_(k) {}

void Fall::set_times(Times& times, int point, double t) const
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

void Fall::avoid(const Box3d& box, double radius)
{
    const Vec3d margin = Vec3d::Constant(radius * (1 + 0x1p-21));
    boxes_.emplace_back(box.min() - margin, box.max() + margin);
    limits_.push_back({by_axis(boxes_.back().min()), by_axis(boxes_.back().max())});
}

// One period. near(p) is told, for each of its points, whether it stays; `largest`, by coordinate, keeps the size of
// what is written.
template <bool Dragged, bool Avoids, class Near>
void Fall::advance_period(float* P, float* v, const Times& times, std::uint32_t* largest, const Near& near) const
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
        largest[l] = std::max({largest[l], magnitude_bits(P1[l]), magnitude_bits(v1[l])});
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

// Whether all of the points are too far from all boxes to come near one in t seconds: by the boxes around their places
// and velocities. Not-a-numbers are found later.
bool Fall::are_far(std::span<const Vec3f> P, std::span<const Vec3f> v, double t) const
{
    using Lanes = Eigen::Array<float, period, 1>;
    const auto box_around = [](std::span<const Vec3f> values) {
        const float* x = coordinates(values);
        const std::size_t size = 3 * values.size();
        Lanes least, most;
        for (std::size_t l = 0; l < period; ++l) least[l] = most[l] = x[l % size];
        std::size_t at = 0;
        for (; at + period <= size; at += period) {
            const Eigen::Map<const Lanes> some(x + at);
            least = least.min(some);
            most = most.max(some);
        }
        for (; at < size; ++at) {
            least[at % 3] = std::min(least[at % 3], x[at]);
            most[at % 3] = std::max(most[at % 3], x[at]);
        }
        Box3d box;
        for (int l = 0; l < period; l += 3) {
            box.extend(least.segment<3>(l).cast<double>().matrix());
            box.extend(most.segment<3>(l).cast<double>().matrix());
        }
        return box;
    };
    const Box3d places = box_around(P), speeds = box_around(v);
    const Vec3d g = Eigen::Map<const Vec3d>(g_.data()), pulled = t * g;
    // Drag makes less of the velocity and of what the acceleration adds, each by itself.
    const Vec3d slowest = k_ == 0 ? Vec3d(speeds.min().cwiseMin(speeds.min() + pulled).cwiseMin(0.0))
                                  : Vec3d(speeds.min().cwiseMin(0.0) + pulled.cwiseMin(0.0));
    const Vec3d fastest = k_ == 0 ? Vec3d(speeds.max().cwiseMax(speeds.max() + pulled).cwiseMax(0.0))
                                  : Vec3d(speeds.max().cwiseMax(0.0) + pulled.cwiseMax(0.0));
    const Vec3d rounding = 0x1p-20 * places.min().cwiseAbs().cwiseMax(places.max().cwiseAbs());
    const Box3d reach(places.min() + t * slowest - rounding, places.max() + t * fastest + rounding);
    return std::none_of(boxes_.begin(), boxes_.end(), [&](const Box3d& box) { return box.intersects(reach); });
}

Fall::Way Fall::advance(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin, std::size_t end,
                        std::vector<std::uint32_t>& near) const
{
    const double longest = std::max(time.h, double(static_cast<float>(time.h)));
    if (limits_.empty() || are_far(P.subspan(begin, end - begin), v.subspan(begin, end - begin), longest))
        return advance_any<false>(P, v, time, begin, end, [](std::uint32_t, bool) {});
    std::size_t count = near.size();
    near.resize(count + (end - begin) + points_a_period);
    const Way way = advance_any<true>(P, v, time, begin, end, [&](std::uint32_t i, bool stays) {
        near[count] = i;
        count += stays && i < end;
    });
    near.resize(count);
    return way;
}

template <bool Avoids, class Near>
Fall::Way Fall::advance_any(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin,
                            std::size_t end, const Near& near) const
{
    return k_ == 0 ? advance_all<false, Avoids>(P, v, time, begin, end, near)
                   : advance_all<true, Avoids>(P, v, time, begin, end, near);
}

template <bool Dragged, bool Avoids, class Near>
Fall::Way Fall::advance_all(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin,
                            std::size_t end, const Near& near) const
{
    // Most points move for the whole frame: their periods share one t.
    const float* own = time.own.data && time.own.stride != 0 ? time.own.data : nullptr;
    bool of_h = own != nullptr;
    Times times;
    const auto set_all = [&](double t) {
        for (int p = 0; p < points_a_period; ++p) set_times(times, p, t);
    };
    set_all(own ? time.h : time(begin));
    std::uint32_t largest[period] = {};
    std::size_t at = begin;
    for (; at < end; at += points_a_period) {
        if ((at - begin) % block == 0) {
            const std::size_t size = std::min(block, end - at);
            if (!all_finite(P.subspan(at, size)) || !all_finite(v.subspan(at, size))) break;
        }
        // What the next block will look at is fetched while this one is computed.
        for (int line = 0; line < 2; ++line) {
            __builtin_prefetch(P.data()->data() + 3 * (at + block) + 16 * line);
            __builtin_prefetch(v.data()->data() + 3 * (at + block) + 16 * line);
        }
        const std::size_t n = std::min<std::size_t>(points_a_period, end - at);
        if (own) {
            bool whole = true;
            for (std::size_t p = 0; p < n; ++p) whole &= own[at + p] == static_cast<float>(time.h);
            if (!whole || !of_h) {
                for (int p = 0; p < points_a_period; ++p) set_times(times, p, time(std::min(at + p, end - 1)));
                of_h = whole;
            }
        }
        const auto list = [&](int p, bool stays) { near(static_cast<std::uint32_t>(at + p), stays); };
        if (n == points_a_period) {
            advance_period<Dragged, Avoids>(P[at].data(), v[at].data(), times, largest, list);
            continue;
        }
        float P_end[period] = {}, v_end[period] = {};
        std::copy_n(P[at].data(), 3 * n, P_end);
        std::copy_n(v[at].data(), 3 * n, v_end);
        advance_period<Dragged, Avoids>(P_end, v_end, times, largest, list);
        std::copy_n(P_end, 3 * n, P[at].data());
        std::copy_n(v_end, 3 * n, v[at].data());
    }
    const bool finite = *std::max_element(largest, largest + period) < infinity_bits;
    return {std::min(at, end), finite};
}

}  // namespace rapid
