#include "runtime/solver/estimate/shadow.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "runtime/base/parallel.h"
#include "runtime/points/id_index.h"
#include "runtime/shapes/path.h"
#include "runtime/solver/estimate/resolution.h"

namespace rapid {
namespace {

constexpr std::size_t fewest_shadows = 1000, max_shadows = 1250;  // if there are that many points
constexpr std::uint32_t gone = UINT32_MAX;                        // the index of a point that has died

// Returns the rank of an id in the random order (SplitMix64, Steele et al. 2014).
std::uint64_t rank_of(std::int64_t id)
{
    std::uint64_t x = static_cast<std::uint64_t>(id) + 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

// Returns true if points are in order of id, which they are unless a script or a merge has reordered them.
bool are_sorted(Strided<std::int64_t> ids, std::size_t size)
{
    if (ids.stride == 0 || size < 2) return size < 2;
    std::atomic<bool> sorted = true;
    for_each_chunk(size - 1, [&](std::size_t begin, std::size_t end) {
        bool ascend = true;
        for (std::size_t i = begin; i < end; ++i) ascend &= ids.data[i] < ids.data[i + 1];
        if (!ascend) sorted.store(false, std::memory_order_relaxed);
    });
    return sorted;
}

// Prefetches id, P and v of these points, which are far apart in memory.
void prefetch(const PointSet& points, std::span<const std::uint32_t> indices)
{
    const Strided<std::int64_t> id = points.id().read();
    const Strided<Vec3f> P = points.P().read(), v = points.v().read();
    for (const std::uint32_t i : indices) {
        if (i >= points.size()) continue;
        __builtin_prefetch(&id[i]);
        __builtin_prefetch(&P[i]);
        __builtin_prefetch(&v[i]);
    }
}

// Returns the index of the first id, from `from` on, that is not lower, for ascending ids. Fast if it is close to and
// not after `guess`.
std::size_t first_near(Strided<std::int64_t> ids, std::size_t size, std::size_t from, std::size_t guess,
                       std::int64_t id)
{
    std::size_t begin = std::clamp(guess + 1, from, size), end = size;
    for (std::size_t step = 16; begin > from && ids[begin - 1] >= id; step *= 2)
        end = begin, begin -= std::min(step, begin - from);
    return first_not_below(ids, begin, end, id);
}

// Returns the index of the point with each of the ascending ids; `gone` if there is no such point. before: the
// previous indices, which are usually right, or too high by the number of removed points before them.
std::vector<std::uint32_t> indices_of(std::span<const std::int64_t> ids, const PointSet& points,
                                      std::span<const std::uint32_t> before)
{
    const Strided<std::int64_t> all = points.id().read();
    std::vector<std::uint32_t> indices(ids.size(), gone);
    std::size_t from = 0, removed = 0;
    bool missed = false;
    for (std::size_t k = 0; k < ids.size(); ++k) {
        if (before[k] < points.size() && all[before[k]] == ids[k]) {
            from = before[k];
        } else {
            from = first_near(all, points.size(), from, before[k] - std::min<std::size_t>(removed, before[k]), ids[k]);
            missed |= from == points.size() || all[from] != ids[k];
            removed = before[k] - std::min<std::size_t>(from, before[k]);
        }
        if (from < points.size() && all[from] == ids[k]) indices[k] = static_cast<std::uint32_t>(from);
    }
    if (!missed || are_sorted(all, points.size())) return indices;  // missed points have died
    std::fill(indices.begin(), indices.end(), gone);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto found = std::lower_bound(ids.begin(), ids.end(), all[i]);
        if (found != ids.end() && *found == all[i])
            indices[static_cast<std::size_t>(found - ids.begin())] = static_cast<std::uint32_t>(i);
    }
    return indices;
}

// Removes the elements of dead points from all lists.
template <class... T>
void keep_found(std::vector<std::uint32_t>& indices, std::vector<T>&... lists)
{
    const auto keep = [&](auto& list) {
        std::size_t kept = 0;
        for (std::size_t k = 0; k < indices.size(); ++k)
            if (indices[k] != gone) list[kept++] = list[k];
        list.resize(kept);
    };
    (keep(lists), ...);
    std::erase(indices, gone);
}

}  // namespace

void Shadows::begin(const PointSet& points, bool is_exact, double h,
                    const std::function<bool(const PointSet& points, std::size_t i)>& arrives)
{
    idle_ = is_exact && !off_;
    prefetch(points, indices_);
    indices_ = indices_of(ids_, points, indices_);
    keep_found(indices_, ids_, dP_, dv_, rounding_);
    prefetch(points, indices_);

    const Strided<std::int64_t> id = points.id().read();
    std::vector<std::pair<std::int64_t, std::uint32_t>> born;
    // Keeps the first ids of the random order. Runs as soon as there are many more, so that ten million simultaneous
    // births need no list.
    const auto thin = [&] {
        std::vector<std::uint64_t> order;
        for (const std::int64_t number : ids_) order.push_back(rank_of(number));
        for (const auto& [number, index] : born) order.push_back(rank_of(number));
        std::nth_element(order.begin(), order.begin() + fewest_shadows, order.end());
        threshold_ = order[fewest_shadows];
        for (std::size_t k = 0; k < ids_.size(); ++k)
            if (rank_of(ids_[k]) >= threshold_) indices_[k] = gone;
        keep_found(indices_, ids_, dP_, dv_, rounding_);
        std::erase_if(born, [&](const auto& point) { return rank_of(point.first) >= threshold_; });
    };
    std::int64_t next = next_id_;
    // Newborn points are at the end. In a set sorted by a script they may be anywhere, and not all are found.
    for (std::size_t i = points.size(); i-- > 0 && id[i] >= next_id_;) {
        next = std::max(next, id[i] + 1);
        if (rank_of(id[i]) >= threshold_) continue;
        born.emplace_back(id[i], static_cast<std::uint32_t>(i));
        if (ids_.size() + born.size() > 4 * max_shadows) thin();
    }
    next_id_ = next;
    if (ids_.size() + born.size() > max_shadows) thin();
    std::sort(born.begin(), born.end());
    for (const auto& [number, index] : born) {
        ids_.push_back(number);
        indices_.push_back(index);
        dP_.push_back(Vec3d::Zero());
        dv_.push_back(Vec3d::Zero());
        rounding_.emplace_back();
    }
    const Strided<Vec3f> P0 = points.P().read(), v0 = points.v().read();
    const auto* own = points.find<float>("dt");
    for (std::size_t k = 0; k < ids_.size(); ++k) {
        const std::uint32_t i = indices_[k];
        rounding_[k] = {P0[i], v0[i], own ? (*own)[i] : h, rounding_[k].displacement};
        if (arrives && arrives(points, i)) dP_[k] = dv_[k] = Vec3d::Zero();
    }
    if (idle_) return;

    before_ = points.select(indices_);
    set_ = before_;
    if (ids_.empty()) return;
    const std::span<Vec3f> P = set_.P().write(), v = set_.v().write();
    for (std::size_t k = 0; k < ids_.size(); ++k) {
        P[k] = (P[k].cast<double>() + dP_[k]).cast<float>();
        v[k] = (v[k].cast<double>() + dv_[k]).cast<float>();
    }
}

// Finds the points again and drops dead ones.
void Shadows::find(const PointSet& solved)
{
    prefetch(solved, indices_);
    indices_ = indices_of(ids_, solved, indices_);
    keep_found(indices_, ids_, dP_, dv_, rounding_);
    add_rounding(solved);
}

void Shadows::add_rounding(const PointSet& solved)
{
    const Strided<Vec3f> P = solved.P().read(), v = solved.v().read();
    for (std::size_t k = 0; k < ids_.size(); ++k) {
        Rounding& point = rounding_[k];
        const Vec3f &P1 = P[indices_[k]], &v1 = v[indices_[k]];
        for (int axis = 0; axis < 3; ++axis) {
            const double displacement = 0.5 * point.dt * (double(point.v[axis]) + double(v1[axis]));
            const double moved = double(P1[axis]) - double(point.P[axis]);
            const double off = displacement - moved, spacing = spacing_at(P1[axis]);
            const double lost = off - spacing * std::nearbyint(off / spacing);  // exact: a power of two
            if (std::isfinite(lost)) point.displacement[axis] += lost;
        }
        point.P = P1;
    }
}

double Shadows::rounding(bool touches) const
{
    double worst = 0;
    for (const Rounding& point : rounding_) {
        const Vec3d spacing(spacing_at(point.P.x()), spacing_at(point.P.y()), spacing_at(point.P.z()));
        const double flush = touches ? flush_within(point.P.cast<double>(), 0, 0) : 0;
        worst = std::max(worst, point.displacement.norm() + 0.5 * spacing.norm() + flush);
    }
    return worst;
}

std::vector<double> Shadows::compare(const PointSet& solved)
{
    prefetch(solved, indices_);
    std::vector<std::uint32_t> own(ids_.size());  // indices in set_
    std::iota(own.begin(), own.end(), 0u);
    own = indices_of(ids_, set_, own);
    keep_found(own, ids_, indices_, rounding_);
    indices_ = indices_of(ids_, solved, indices_);
    keep_found(indices_, ids_, own, rounding_);
    add_rounding(solved);
    dP_.resize(ids_.size());
    dv_.resize(ids_.size());
    const Strided<Vec3f> P = solved.P().read(), v = solved.v().read();
    const Strided<Vec3f> shadow_P = std::as_const(set_).P().read(), shadow_v = std::as_const(set_).v().read();
    std::vector<double> errors(ids_.size());
    off_ = false;
    for (std::size_t k = 0; k < ids_.size(); ++k) {
        dP_[k] = shadow_P[own[k]].cast<double>() - P[indices_[k]].cast<double>();
        dv_[k] = shadow_v[own[k]].cast<double>() - v[indices_[k]].cast<double>();
        errors[k] = 2 * dP_[k].norm();
        off_ |= !dP_[k].isZero(0) || !dv_[k].isZero(0);
    }
    before_ = set_ = PointSet();
    return errors;
}

}  // namespace rapid
