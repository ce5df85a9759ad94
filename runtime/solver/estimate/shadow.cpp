#include "runtime/solver/estimate/shadow.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

namespace rapid {
namespace {

constexpr std::size_t fewest = 1000, most = 1250;  // shadows, of more points than these
constexpr std::uint32_t gone = UINT32_MAX;

// The place of an id in the random order (Steele et al. 2014, SplitMix64).
std::uint64_t place_in_order(std::int64_t id)
{
    std::uint64_t x = static_cast<std::uint64_t>(id) + 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

// Whether points are in order of their ids, as they are but where a script has sorted or merged them.
bool are_sorted(Strided<std::int64_t> ids, std::size_t size)
{
    if (ids.stride == 0) return size < 2;
    bool sorted = true;
    for (std::size_t i = 1; i < size; ++i) sorted &= ids.data[i - 1] < ids.data[i];
    return sorted;
}

// Has what is looked at of these points brought near, all of it at once: they are far apart in memory.
void fetch(const PointSet& points, std::span<const std::uint32_t> places)
{
    const Strided<std::int64_t> id = points.id().read();
    const Strided<Vec3f> P = points.P().read(), v = points.v().read();
    for (const std::uint32_t place : places) {
        if (place >= points.size()) continue;
        __builtin_prefetch(&id[place]);
        __builtin_prefetch(&P[place]);
        __builtin_prefetch(&v[place]);
    }
}

// For each of the ascending ids its place among the points; `gone` where none has it. `before`: where it was, which is
// most often where it is.
std::vector<std::uint32_t> places_of(std::span<const std::int64_t> ids, const PointSet& points,
                                     std::span<const std::uint32_t> before)
{
    const Strided<std::int64_t> all = points.id().read();
    std::vector<std::uint32_t> places(ids.size(), gone);
    std::size_t from = 0;
    bool missed = false;
    for (std::size_t k = 0; k < ids.size(); ++k) {
        if (before[k] < points.size() && all[before[k]] == ids[k]) {
            places[k] = before[k];
            from = before[k];
            continue;
        }
        std::size_t count = points.size() - from;
        while (count > 0) {  // the first that is not below
            const std::size_t half = count / 2;
            if (all[from + half] < ids[k]) {
                from += half + 1;
                count -= half + 1;
            } else {
                count = half;
            }
        }
        if (from < points.size() && all[from] == ids[k])
            places[k] = static_cast<std::uint32_t>(from);
        else
            missed = true;
    }
    if (!missed || are_sorted(all, points.size())) return places;  // those that are missed have died
    std::fill(places.begin(), places.end(), gone);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto found = std::lower_bound(ids.begin(), ids.end(), all[i]);
        if (found != ids.end() && *found == all[i])
            places[static_cast<std::size_t>(found - ids.begin())] = static_cast<std::uint32_t>(i);
    }
    return places;
}

// Keeps the elements whose place is known, of all lists alike.
template <class... T>
void keep_found(std::vector<std::uint32_t>& places, std::vector<T>&... lists)
{
    const auto keep = [&](auto& list) {
        std::size_t kept = 0;
        for (std::size_t k = 0; k < places.size(); ++k)
            if (places[k] != gone) list[kept++] = list[k];
        list.resize(kept);
    };
    (keep(lists), ...);
    std::erase(places, gone);
}

}  // namespace

void Shadows::begin(const PointSet& points, bool is_exact)
{
    idle_ = is_exact && !off_;
    if (idle_) return;
    fetch(points, places_);
    places_ = places_of(ids_, points, places_);
    keep_found(places_, ids_, dP_, dv_);

    const Strided<std::int64_t> id = points.id().read();
    std::vector<std::pair<std::int64_t, std::uint32_t>> born;
    // Leaves the first of the random order, as soon as there are many more: of ten million births at once no list is
    // made.
    const auto thin = [&] {
        std::vector<std::uint64_t> order;
        for (const std::int64_t number : ids_) order.push_back(place_in_order(number));
        for (const auto& [number, place] : born) order.push_back(place_in_order(number));
        std::nth_element(order.begin(), order.begin() + fewest, order.end());
        threshold_ = order[fewest];
        for (std::size_t k = 0; k < ids_.size(); ++k)
            if (place_in_order(ids_[k]) >= threshold_) places_[k] = gone;
        keep_found(places_, ids_, dP_, dv_);
        std::erase_if(born, [&](const auto& point) { return place_in_order(point.first) >= threshold_; });
    };
    std::int64_t next = next_id_;
    // Newborn are at the end; of a set that a script has sorted they may be anywhere, and are then looked for no
    // farther.
    for (std::size_t i = points.size(); i-- > 0 && id[i] >= next_id_;) {
        next = std::max(next, id[i] + 1);
        if (place_in_order(id[i]) >= threshold_) continue;
        born.emplace_back(id[i], static_cast<std::uint32_t>(i));
        if (ids_.size() + born.size() > 4 * most) thin();
    }
    next_id_ = next;
    if (ids_.size() + born.size() > most) thin();
    std::sort(born.begin(), born.end());
    for (const auto& [number, place] : born) {
        ids_.push_back(number);
        places_.push_back(place);
        dP_.push_back(Vec3d::Zero());
        dv_.push_back(Vec3d::Zero());
    }

    before_ = points.select(places_);
    set_ = before_;
    if (ids_.empty()) return;
    const std::span<Vec3f> P = set_.P().write(), v = set_.v().write();
    for (std::size_t k = 0; k < ids_.size(); ++k) {
        P[k] = (P[k].cast<double>() + dP_[k]).cast<float>();
        v[k] = (v[k].cast<double>() + dv_[k]).cast<float>();
    }
}

std::vector<double> Shadows::compare(const PointSet& solved)
{
    fetch(solved, places_);
    std::vector<std::uint32_t> own(ids_.size());  // in set_, which begins as these
    std::iota(own.begin(), own.end(), 0u);
    own = places_of(ids_, set_, own);
    keep_found(own, ids_, places_);
    places_ = places_of(ids_, solved, places_);
    keep_found(places_, ids_, own);
    dP_.resize(ids_.size());
    dv_.resize(ids_.size());
    const Strided<Vec3f> P = solved.P().read(), v = solved.v().read();
    const Strided<Vec3f> shadow_P = std::as_const(set_).P().read(), shadow_v = std::as_const(set_).v().read();
    std::vector<double> errors(ids_.size());
    off_ = false;
    for (std::size_t k = 0; k < ids_.size(); ++k) {
        dP_[k] = shadow_P[own[k]].cast<double>() - P[places_[k]].cast<double>();
        dv_[k] = shadow_v[own[k]].cast<double>() - v[places_[k]].cast<double>();
        errors[k] = 2 * dP_[k].norm();
        off_ |= !dP_[k].isZero(0) || !dv_[k].isZero(0);
    }
    before_ = set_ = PointSet();
    return errors;
}

}  // namespace rapid
