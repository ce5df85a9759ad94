#include "runtime/solver/motion/ballistic_batch.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "runtime/math/path_extent.h"
#include "runtime/solver/motion/damped_motion.h"

namespace rapid {
namespace {

// Points per block: tested and then advanced while they are in the first-level cache.
constexpr std::size_t points_per_block = 512;

[[gnu::always_inline]] inline FloatFlags magnitude_bits(const Floats& x)
{
    return std::bit_cast<FloatFlags>(x) & 0x7fffffff;
}

[[gnu::always_inline]] inline FloatFlags largest_of(const FloatFlags& a, const FloatFlags& b) { return a > b ? a : b; }

}  // namespace

BallisticBatch::BallisticBatch(const Vec3d& g, double k) : g_(g), k_(k), packed_g_(repeated(g)) {}

void BallisticBatch::avoid(const Box3d& box, double radius)
{
    boxes_.push_back(widened(box, radius));
    limits_.push_back({repeated(boxes_.back().min()), repeated(boxes_.back().max())});
}

void BallisticBatch::set_propagator(Propagators& all, std::uint32_t point, double t) const
{
    const Propagator by = k_ == 0 ? Propagator() : respond(k_, 0, t);
    all.t.set_point(point, t);
    all.x_of_v.set_point(point, by.x_of_v);
    all.v_of_v.set_point(point, by.v_of_v);
    for (std::uint32_t l = 3 * point; l < 3 * point + 3; ++l) {
        all.fallen.set(l, by.x_of_G * g_[l % 3]);
        all.gained.set(l, by.v_of_G * g_[l % 3]);
    }
}

BallisticBatch::Clock::Clock(const BallisticBatch& batch, const OwnTime& time, std::size_t begin)
    : batch_(batch),
      time_(time),
      own_(time.own.data && time.own.stride != 0 ? time.own.data : nullptr),
      is_of_whole_frame_(own_)
{
    for (std::uint32_t p = 0; p < lanes; ++p) batch_.set_propagator(propagators_, p, own_ ? time.h : time(begin));
}

void BallisticBatch::Clock::set(std::size_t first, std::size_t n)
{
    bool whole = true;
    for (std::size_t p = 0; p < n; ++p) whole &= own_[first + p] == static_cast<float>(time_.h);
    if (whole && is_of_whole_frame_) return;
    for (std::uint32_t p = 0; p < lanes; ++p)
        batch_.set_propagator(propagators_, p, time_(first + std::min<std::size_t>(p, n - 1)));
    is_of_whole_frame_ = whole;
}

// Advances eight points. Returns bit 3 p for each point p that is left unchanged. Unless the result is known to be
// finite, `largest` keeps the largest magnitude written.
template <bool Dragged, bool Avoids, bool Checks>
[[gnu::always_inline]] inline std::uint32_t BallisticBatch::advance_pack(float* P, float* v, const Propagators& by,
                                                                         Largest& largest) const
{
    PackedPoints<Floats> P0, v0, P1, v1;
    [[maybe_unused]] PathExtent<Doubles> extent[3];
    for (std::uint32_t k = 0; k < 3; ++k) {
        P0[k] = load_pack(P + lanes * k);
        v0[k] = load_pack(v + lanes * k);
        const Doubles x = widen(P0[k]), u = widen(v0[k]), &t = by.t[k];
        Doubles x1, u1, sagging;
        if constexpr (Dragged) {
            x1 = x + (by.x_of_v[k] * u + by.fallen[k]);
            u1 = by.v_of_v[k] * u + by.gained[k];
            // The velocity changes monotonically from u to u1: a quarter of the difference, times t. The parabolas of
            // Collisions deviate from this path by up to another quarter of the fall.
            sagging = 0.25 * (t * magnitude(u1 - u) + magnitude(by.fallen[k]));
        } else {
            const Doubles gain = t * packed_g_[k];
            x1 = x + t * (u + 0.5 * gain);
            u1 = u + gain;
            sagging = magnitude(0.125 * t * gain);
        }
        P1[k] = narrow(x1);
        v1[k] = narrow(u1);
        if constexpr (Checks)
            largest[k] = largest_of(largest[k], largest_of(magnitude_bits(P1[k]), magnitude_bits(v1[k])));
        if constexpr (Avoids) extent[k] = PathExtent<Doubles>::of(x, x1, sagging);
    }
    std::uint32_t near = 0;
    if constexpr (Avoids) {
        for (const Limits& box : limits_) {
            std::uint32_t misses = 0;
            for (std::uint32_t k = 0; k < 3; ++k) misses |= bits(extent[k].misses(box.min[k], box.max[k])) << lanes * k;
            near |= every_point & ~any_of_point(misses);
        }
        if (near != 0) {
            const std::uint32_t stays = near | near << 1 | near << 2;
            for (std::uint32_t k = 0; k < 3; ++k) {
                const FloatFlags stay = float_flags(stays >> lanes * k);
                P1[k] = stay ? P0[k] : P1[k];
                v1[k] = stay ? v0[k] : v1[k];
            }
        }
    }
    for (std::uint32_t k = 0; k < 3; ++k) {
        store_pack(P1[k], P + lanes * k);
        store_pack(v1[k], v + lanes * k);
    }
    return near;
}

BallisticBatch::Bounds BallisticBatch::bounds_of(std::span<const Vec3f> values)
{
    const float* x = coordinates(values);
    const std::size_t size = 3 * values.size();
    float few[coordinates_per_pack];
    if (size < coordinates_per_pack) {
        for (std::size_t l = 0; l < coordinates_per_pack; ++l) few[l] = x[l % size];
        x = few;
    }
    PackedPoints<Floats> low, high;
    Largest largest = {};
    for (std::uint32_t k = 0; k < 3; ++k) low[k] = high[k] = load_pack(x + lanes * k);
    const auto take = [&](std::size_t l) __attribute__((always_inline))
    {
        for (std::uint32_t k = 0; k < 3; ++k) {
            const Floats some = load_pack(x + l + lanes * k);
            low[k] = some < low[k] ? some : low[k];
            high[k] = some > high[k] ? some : high[k];
            largest[k] = largest_of(largest[k], magnitude_bits(some));
        }
    };
    for (std::size_t l = 0; l + coordinates_per_pack < size; l += coordinates_per_pack) take(l);
    take(std::max<std::size_t>(size, coordinates_per_pack) - coordinates_per_pack);

    Bounds bounds{Box3d(), progress(0, largest).finite};
    for (std::uint32_t l = 0; l < coordinates_per_pack; l += 3) {
        const auto at = [l](const PackedPoints<Floats>& packed, std::uint32_t axis) {
            return double(packed[(l + axis) / lanes][(l + axis) % lanes]);
        };
        bounds.box.extend(Vec3d(at(low, 0), at(low, 1), at(low, 2)));
        bounds.box.extend(Vec3d(at(high, 0), at(high, 1), at(high, 2)));
    }
    return bounds;
}

// Returns true if no point with these positions and velocities comes near a box in t seconds, and all stay finite.
bool BallisticBatch::are_far(const Box3d& positions, const Box3d& velocities, double t) const
{
    const Vec3d gain = t * g_;
    // Drag reduces the velocity and the contribution of the acceleration separately.
    const Vec3d slowest = k_ == 0 ? Vec3d(velocities.min().cwiseMin(velocities.min() + gain).cwiseMin(0.0))
                                  : Vec3d(velocities.min().cwiseMin(0.0) + gain.cwiseMin(0.0));
    const Vec3d fastest = k_ == 0 ? Vec3d(velocities.max().cwiseMax(velocities.max() + gain).cwiseMax(0.0))
                                  : Vec3d(velocities.max().cwiseMax(0.0) + gain.cwiseMax(0.0));
    const Vec3d rounding = 0x1p-20 * positions.min().cwiseAbs().cwiseMax(positions.max().cwiseAbs());
    const Box3d reach(positions.min() + t * slowest - rounding, positions.max() + t * fastest + rounding);
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
    if (limits_.empty())
        return k_ == 0 ? advance_all<false, false>(P, v, time, begin, end, near)
                       : advance_all<true, false>(P, v, time, begin, end, near);
    return k_ == 0 ? advance_all<false, true>(P, v, time, begin, end, near)
                   : advance_all<true, true>(P, v, time, begin, end, near);
}

// Most blocks have a bounding box that is far from all shapes, and need no test of individual points.
template <bool Dragged, bool Avoids>
BallisticBatch::Progress BallisticBatch::advance_all(std::span<Vec3f> P, std::span<Vec3f> v, const OwnTime& time,
                                                     std::size_t begin, std::size_t end,
                                                     std::vector<std::uint32_t>& near) const
{
    const double longest = std::max(time.h, double(static_cast<float>(time.h)));
    Clock clock(*this, time, begin);
    Largest largest = {};
    for (std::size_t at = begin; at < end; at += points_per_block) {
        const std::size_t size = std::min(points_per_block, end - at);
        if constexpr (!Avoids) {
            if (!all_finite(P.subspan(at, size)) || !all_finite(v.subspan(at, size))) return progress(at, largest);
            advance_block<Dragged, false, true>(P, v, clock, at, at + size, largest, nullptr);
        } else {
            const Bounds positions = bounds_of(P.subspan(at, size)), velocities = bounds_of(v.subspan(at, size));
            if (!positions.finite || !velocities.finite) return progress(at, largest);
            if (are_far(positions.box, velocities.box, longest))
                advance_block<Dragged, false, false>(P, v, clock, at, at + size, largest, nullptr);
            else
                advance_block<Dragged, true, true>(P, v, clock, at, at + size, largest, &near);
        }
    }
    return progress(end, largest);
}

BallisticBatch::Progress BallisticBatch::progress(std::size_t end, const Largest& largest)
{
    std::int32_t most = 0;
    for (std::uint32_t l = 0; l < coordinates_per_pack; ++l) most = std::max(most, largest[l / lanes][l % lanes]);
    return {end, most < static_cast<std::int32_t>(infinity_bits)};
}

template <bool Dragged, bool Avoids, bool Checks>
void BallisticBatch::advance_block(std::span<Vec3f> P, std::span<Vec3f> v, Clock& clock, std::size_t begin,
                                   std::size_t end, Largest& largest, std::vector<std::uint32_t>* near) const
{
    Largest own_largest = largest;  // in registers
    for (std::size_t at = begin; at < end; at += lanes) {
        // Prefetches the next block while this one is computed.
        for (int line = 0; line < 2; ++line) {
            __builtin_prefetch(P.data()->data() + 3 * (at + points_per_block) + 16 * line);
            __builtin_prefetch(v.data()->data() + 3 * (at + points_per_block) + 16 * line);
        }
        const std::size_t n = std::min<std::size_t>(lanes, end - at);
        const Propagators& by = clock.of(at, n);
        std::uint32_t stay;
        if (n == lanes) {
            stay = advance_pack<Dragged, Avoids, Checks>(P[at].data(), v[at].data(), by, own_largest);
        } else {
            float P_some[coordinates_per_pack] = {}, v_some[coordinates_per_pack] = {};
            std::copy_n(P[at].data(), 3 * n, P_some);
            std::copy_n(v[at].data(), 3 * n, v_some);
            stay = advance_pack<Dragged, Avoids, Checks>(P_some, v_some, by, own_largest);
            std::copy_n(P_some, 3 * n, P[at].data());
            std::copy_n(v_some, 3 * n, v[at].data());
            stay &= (1u << 3 * n) - 1;
        }
        if constexpr (Avoids)
            for (; stay != 0; stay &= stay - 1)
                near->push_back(static_cast<std::uint32_t>(at + std::countr_zero(stay) / 3));
    }
    largest = own_largest;
}

}  // namespace rapid
