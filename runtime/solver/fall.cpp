#include "runtime/solver/fall.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace rapid {
namespace {

// a where all bits are set, b where none is.
float chosen(std::uint32_t bits, float a, float b)
{
    return std::bit_cast<float>((std::bit_cast<std::uint32_t>(a) & bits) | (std::bit_cast<std::uint32_t>(b) & ~bits));
}

}  // namespace

Fall::Period Fall::by_axis(const Vec3d& x)
{
    Period all;
    for (int l = 0; l < period; ++l) all[l] = x[l % 3];
    return all;
}

Fall::Fall(const Vec3d& g) : g_(by_axis(g)) {}

void Fall::avoid(const Box3d& box, double radius)
{
    const Vec3d margin = Vec3d::Constant(radius * (1 + 0x1p-21));
    limits_.push_back({by_axis(box.min() - margin), by_axis(box.max() + margin)});
}

// near(p) is told, for each of the period's points, whether it stays.
template <class Near>
void Fall::advance_period(float* P, float* v, const Period& t, const Near& near) const
{
    float P1[period], v1[period];
    double lowest[period], highest[period];
    for (int l = 0; l < period; ++l) {
        const double x = P[l], u = v[l], gain = t[l] * g_[l];
        const double x1 = x + t[l] * (u + 0.5 * gain);
        // The parabola is off the straight line by a t²/8 at most. The factor keeps a point that is flush with a box
        // and rounded away from it.
        const double margin = std::abs(0.125 * t[l] * gain) + 0x1p-21 * std::abs(x);
        lowest[l] = std::min(x, x1) - margin;
        highest[l] = std::max(x, x1) + margin;
        P1[l] = static_cast<float>(x1);
        v1[l] = static_cast<float>(u + gain);
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

void Fall::advance(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time, std::size_t begin, std::size_t end,
                   std::vector<std::uint32_t>& near) const
{
    std::size_t count = near.size();
    near.resize(count + (end - begin) + points_a_period);
    // Most points move for the whole frame: their periods share one t.
    const float* own = time.own.data && time.own.stride != 0 ? time.own.data : nullptr;
    bool of_h = true;
    Period t;
    t.fill(time(begin));
    if (own) t.fill(time.h);
    for (std::size_t at = begin; at < end; at += points_a_period) {
        const std::size_t n = std::min<std::size_t>(points_a_period, end - at);
        if (own) {
            bool whole = true;
            for (std::size_t p = 0; p < n; ++p) whole &= own[at + p] == static_cast<float>(time.h);
            if (!whole || !of_h) {
                for (int p = 0; p < points_a_period; ++p) std::fill_n(&t[3 * p], 3, time(std::min(at + p, end - 1)));
                of_h = whole;
            }
        }
        const auto list = [&](int p, bool stays) {
            near[count] = static_cast<std::uint32_t>(at + p);
            count += stays && std::size_t(p) < n;
        };
        if (n == points_a_period) {
            advance_period(P[at].data(), v[at].data(), t, list);
            continue;
        }
        float P_end[period] = {}, v_end[period] = {};
        std::copy_n(P[at].data(), 3 * n, P_end);
        std::copy_n(v[at].data(), 3 * n, v_end);
        advance_period(P_end, v_end, t, list);
        std::copy_n(P_end, 3 * n, P[at].data());
        std::copy_n(v_end, 3 * n, v[at].data());
    }
    near.resize(count);
}

}  // namespace rapid
