#include "runtime/solver/constraints/contacts.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

#include "runtime/base/parallel.h"
#include "runtime/base/per_thread.h"
#include "runtime/base/stopwatch.h"
#include "runtime/points/id_index.h"
#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/contact_forces.h"
#include "runtime/solver/constraints/contact_solver.h"
#include "runtime/solver/constraints/energy_bound.h"
#include "runtime/solver/constraints/impact.h"
#include "runtime/solver/constraints/spin.h"
#include "runtime/solver/figures.h"

namespace rapid {
namespace {

// The fraction of an overlap that is removed in a substep. It is smaller for overlaps with a sleeper: two sleepers
// that hold a point between them do not give way, so the point would be pushed back and forth.
constexpr double overlap_recovery = 0.8, overlap_recovery_asleep = 0.1;

// One sweep leaves a few overlaps much deeper than the rest. Those above deep_overlap, relative to the smaller radius,
// are recovered by additional sweeps, forwards and backwards, at little cost because they are few. The candidates are
// contacts with an overlap above deep_part_of_reach, relative to the sum of the radii.
constexpr double deep_overlap = 0.02, deep_part_of_reach = 0.005;
constexpr int deep_sweeps = 2;  // even: forces are recorded in the order of the first sweep

// With 1.5, columns of grain overlap even less, but the error of their grains' paths doubles. Not applied if points
// may sleep, because piles would take longer to come to rest.
constexpr double over_relaxation = 1.2;

// Returns the overlap above which a contact is violated, m.
double violating_overlap(const ContactMaterial& material, std::uint32_t i, std::uint32_t j)
{
    return 0.1 * std::min(material.radius[i], material.radius[j]);
}

// The largest distance by which carried impulses may separate points of one island of rods, relative to their
// distance.
constexpr double max_separation = 0.25;

// Separates coincident points along a pseudo-random direction that differs between pairs.
Vec3d arbitrary_direction(std::uint32_t i, std::uint32_t j)
{
    const std::uint32_t mixed = (i * 0x9e3779b9u) ^ (j * 0x85ebca6bu);
    return Vec3d(1.0 + (mixed & 255), 1.0 + (mixed >> 8 & 255), 1.0 + (mixed >> 16 & 255)).normalized();
}

Vectors<Doubles> directions(const Vectors<Doubles>& d, const ContactPack& pack)
{
    const Doubles length = sqrt(dot(d, d));
    Vectors<Doubles> n = (1 / length) * d;
    if (any(!(length > 0)))
        for (std::uint32_t l = 0; l < lanes; ++l)
            if (!(length[l] > 0)) n.set(l, arbitrary_direction(pack.i[l], pack.j[l]));
    return n;
}

// Returns true if every point is assigned to a grid at least as large as its radius, or to no grid.
bool are_of(const RadiusGrids& all, std::span<const float> radius)
{
    const auto& [grids, of, error, excess] = all;
    if (of.empty() ? grids.size() > 1 : of.size() != radius.size()) return false;
    for (std::size_t g = 0; g < grids.size(); ++g)
        if (!std::isfinite(grids[g].radius) || (g > 0 && !(grids[g].radius < grids[g - 1].radius))) return false;
    for (std::size_t i = 0; i < radius.size(); ++i) {
        const std::size_t g = of.empty() ? 0 : of[i];
        if (g < grids.size() ? !(0 < radius[i] && radius[i] <= grids[g].radius) : radius[i] > 0) return false;
    }
    return true;
}

}  // namespace

void Contacts::follow(const PointSet& points, const ContactOptions& options, const std::string& group)
{
    disturbed_.clear();
    const ContactMaterial before = std::exchange(material_, ContactMaterial(points, options, group));
    const bool same_radii = material_.radius == before.radius;
    if (!same_radii)
        grids_ = RadiusGrids({material_.radius.data(), 1}, points.size(), options.max_difference, options.max_grids);
    scaling_.set(options.mass_scaling);
    records_ = options.record;
    search_seconds_ = 0;
    begins_frame_ = true;

    const Strided<std::int64_t> id = points.id().read();
    const bool same_points = ids_.size() == points.size() && std::equal(ids_.begin(), ids_.end(), id.data);
    std::vector<std::uint32_t> index(ids_.size());  // current indices of the points of the previous frame
    std::iota(index.begin(), index.end(), 0u);
    if (!same_points) {
        const IdIndex by_id(points.id());
        for (std::size_t i = 0; i < ids_.size(); ++i) index[i] = by_id[ids_[i]];
    }
    for (std::size_t k = 0; k < index.size(); ++k) {
        const std::uint32_t i = index[k];
        if (i != IdIndex::none &&
            (material_.radius[i] != before.radius[k] || material_.root_friction[i] != before.root_friction[k]))
            disturbed_.push_back(i);
    }
    list_is_stale_ |= !same_points || !same_radii;
    births_overlap_ = false;
    births_.assign(points.size(), Birth::Apart);
    for (const std::uint32_t i : index)
        if (i != IdIndex::none) births_[i] = Birth::Before;
    const Strided<Vec3f> P = points.P().read();
    birthplaces_.resize(points.size());
    for (std::size_t i = 0; i < births_.size(); ++i)
        if (births_[i] == Birth::Apart) birthplaces_[i] = P[i];
    if (!same_points) renumber(points.id(), index);
}

// Stale lists are not checked: they and their blocks are rebuilt before use.
bool Contacts::is_consistent() const
{
    const std::size_t points = ids_.size(), pairs = impulses_.pairs.size();
    const auto has = [](const auto& list, std::size_t size) { return list.size() == size; };
    const auto has_or_empty = [&](const auto& list, std::size_t size) { return list.empty() || has(list, size); };
    if (!has(material_.radius, points) || !has(material_.root_friction, points) ||
        !has(material_.restitution, points) || !has_or_empty(material_.rolling, points) ||
        !are_of(grids_, material_.radius))
        return false;
    if (!are_below(impulses_.pairs, points) || !has(impulses_.normal, pairs) || !has(impulses_.tangential, pairs) ||
        !has_or_empty(impulses_.resting, pairs) || !has_or_empty(impulses_.rolling, pairs) ||
        !is_between(per_dt_, 0, std::numeric_limits<double>::max()))
        return false;
    if (list_is_stale_) return blocks_.size() == 0 || blocks_.are_of(pairs);
    return blocks_.are_of(pairs) && list_.is_of(points) && blocks_.have_listed(list_.pairs().size()) &&
           has(reach_, pairs + lanes);
}

void Contacts::renumber(const Column<std::int64_t>& ids, std::span<const std::uint32_t> index)
{
    const Strided<std::int64_t> id = ids.read();
    ids_.assign(id.data, id.data + ids.size());
    impulses_.renumber(index, disturbed_);
    blocks_.clear();
    packs_.resize(0);
}

void Contacts::search(const Substep& step)
{
    const Stopwatch stopwatch;
    note_hits(0);
    list_.build(step, material_.radius, grids_);
    std::swap(impulses_, previous_);
    blocks_.build(list_, impulses_.pairs);
    impulses_.take_over(previous_, list_.pairs(), blocks_.slots(), sleep_.sleep());
    if (material_.turns()) impulses_.rolling.resize(impulses_.pairs.size(), Vec3f::Zero());
    packs_.resize(blocks_.size());
    measure_reaches(0);
    hit_.assign(material_.bounces ? impulses_.pairs.size() : 0, 0);
    search_seconds_ += stopwatch.seconds();
}

void Contacts::follow_strays(const Substep& step)
{
    const Stopwatch stopwatch;
    const std::size_t listed = list_.pairs().size();
    const std::vector<ContactPair>& found = strays_.find(step, material_.radius, list_);
    note_hits(listed);
    if (impulses_.set_unlisted(listed, found)) {
        const std::size_t size = impulses_.pairs.size();
        if (material_.turns()) impulses_.rolling.resize(size, Vec3f::Zero());
        blocks_.set_unlisted(size - listed);
        packs_.resize(blocks_.size());
        measure_reaches(listed);
    }
    hit_.resize(material_.bounces ? listed : 0);
    hit_.resize(material_.bounces ? impulses_.pairs.size() : 0, 0);
    search_seconds_ += stopwatch.seconds();
}

// Is called before the pairs from index `from` on change.
void Contacts::note_hits(std::size_t from)
{
    for (std::size_t k = from; k < hit_.size(); ++k)
        if (hit_[k]) hit_before_.push_back(impulses_.pairs[k]);
}

void Contacts::measure_reaches(std::size_t from)
{
    const std::vector<ContactPair>& pairs = impulses_.pairs;
    reach_.resize(pairs.size() + lanes);
    for_each_chunk(pairs.size() - from, [&](std::size_t first, std::size_t last) {
        for (std::size_t k = from + first; k < from + last; ++k)
            reach_[k] = static_cast<float>(material_.reach(pairs[k][0], pairs[k][1]));
    });
}

// Alternates the direction: a fixed order would accumulate the sweeps' remaining error on one side.
template <class F>
void Contacts::sweep(const F& f)
{
    blocks_.for_each_coloured(backwards_, [&](std::size_t b) { in_turn(packs_[b], f); });
}

template <class T, class F>
void Contacts::in_turn(std::vector<T>& list, const F& f) const
{
    if (backwards_)
        std::for_each(list.rbegin(), list.rend(), f);
    else
        std::for_each(list.begin(), list.end(), f);
}

void Contacts::join(Sleep* sleep)
{
    sleep_.join(sleep);
    if (!sleep) return;
    for (const std::uint32_t i : disturbed_) sleep->keep_awake(i);
}

void Contacts::detect(Substep& step)
{
    if (per_dt_ > 0 && per_dt_ * step.dt != 1) impulses_.scale(static_cast<float>(step.dt * per_dt_));
    per_dt_ = 1 / step.dt;
    const bool begins_frame = std::exchange(begins_frame_, false);
    if (begins_frame) heavy_.begin(step);
    scaling_.begin(step);
    hit_.assign(material_.bounces ? impulses_.pairs.size() : 0, 0);
    hit_before_.clear();
    update_contacts(step);
    if (begins_frame) find_overlapping_births(step);
}

// At the first substep other constraints may have moved the points already.
void Contacts::find_overlapping_births(const Substep& step)
{
    const auto position = [&](std::uint32_t i) {
        return births_[i] == Birth::Before ? step.start[i] : Vec3d(birthplaces_[i].cast<double>());
    };
    packs_.for_each([&](const PairContact& contact) {
        const std::uint32_t i = contact.i, j = contact.j;
        if (births_[i] == Birth::Before && births_[j] == Birth::Before) return;
        if (!(contact.reach - (position(i) - position(j)).norm() > violating_overlap(material_, i, j))) return;
        for (const std::uint32_t k : {i, j})
            if (births_[k] == Birth::Apart) births_[k] = Birth::Inside;
    });
}

void Contacts::update_contacts(Substep& step)
{
    if (list_is_stale_ || list_.expired(step))
        search(step);
    else
        follow_strays(step);
    list_is_stale_ = impacts_moved_ = false;
    find_contacts(step);
    if (sleep_.wake_by_impact(packs_, impulses_, material_, step)) find_contacts(step);
}

// An impact may move points into others that were not near. After the last one, contacts are therefore searched again.
bool Contacts::solve_impacts(Substep& step, std::uint32_t sweep)
{
    bool hit = sweep_impacts(step, sweep, sweep - 1);
    if (!hit && impacts_moved_) {
        update_contacts(step);
        hit = sweep_impacts(step, sweep, 1);
    }
    impacts_moved_ |= hit;
    return hit;
}

// Sweeps over points that were hit in sweep `since` or later; 0 for all.
bool Contacts::sweep_impacts(Substep& step, std::uint32_t number, std::uint32_t since)
{
    const double at_rest = resting_speed(step);
    const auto changed = [&](const ContactPack& pack) {
        std::uint32_t last = 0;
        for (std::uint32_t l = 0; l < lanes; ++l)
            last = std::max({last, step.paths[pack.i[l]].sweep, step.paths[pack.j[l]].sweep});
        return last >= since;
    };
    std::atomic<bool> hit = false;
    backwards_ = !backwards_;
    sweep([&](const ContactPack& pack) {
        if (changed(pack) && rapid::solve_impacts(pack, step, at_rest, number, hit_))
            hit.store(true, std::memory_order_relaxed);
    });
    return hit;
}

// Finds pairs that touch at the end of their free motion, or were under pressure until now.
void Contacts::find_contacts(const Substep& step)
{
    packs_.begin(step.size());
    blocks_.for_each_coloured(backwards_, [&](std::size_t b) {
        thread_local PerThread<std::vector<std::uint32_t>> kept;
        std::vector<std::uint32_t>& near = *kept;
        const auto found = static_cast<std::ptrdiff_t>(find_near(b, step, near));  // first: it resizes `near`
        const auto last = near.begin() + found;
        const auto end = std::remove_if(near.begin(), last, [&](std::uint32_t k) { return !may_touch(k, step); });
        packs_.pack(b, {near.begin(), end}, impulses_.pairs);
        for (ContactPack& pack : packs_[b]) begin(pack, step);
    });
}

// Lists the near pairs of a block without a branch, which would be mispredicted for every other pair.
std::size_t Contacts::find_near(std::size_t block, const Substep& step, std::vector<std::uint32_t>& near) const
{
    const std::uint32_t first = blocks_.begin(block), last = blocks_.end(block);
    near.resize(last - first + lanes);
    std::size_t found = 0;
    for (std::uint32_t k = first; k < last; k += lanes) {
        const std::uint32_t count = std::min(lanes, last - k);
        Indices i, j;
        for (std::uint32_t l = 0; l < lanes; ++l) {
            const ContactPair& pair = impulses_.pairs[k + std::min(l, count - 1)];
            i[l] = pair[0], j[l] = pair[1];
        }
        Floats reach;
        std::memcpy(&reach, &reach_[k], sizeof reach);
        const Vectors<Doubles> d = gather(step.points, i).P - gather(step.points, j).P;
        const Doubles farthest = near_contact * widen(reach);
        const std::uint64_t are_near = bytes(dot(d, d) <= farthest * farthest);
        for (std::uint32_t l = 0; l < count; ++l) {
            near[found] = k + l;
            found += (are_near >> 8 * l & 1) | (impulses_.normal[k + l] > 0);
        }
    }
    return found;
}

// Returns true if a near pair is a contact.
bool Contacts::may_touch(std::uint32_t pair, const Substep& step) const
{
    const auto [i, j] = impulses_.pairs[pair];
    if (!step.lives(i) || !step.lives(j)) return false;
    if (!excluded_.empty() &&
        std::binary_search(excluded_.begin(), excluded_.end(), ContactPair{std::min(i, j), std::max(i, j)}))
        return false;
    if (step.points[i].w + step.points[j].w > 0) return true;
    // A moving point of infinite mass wakes a sleeper that it touches.
    if (step.v[i] != step.v[j]) sleep_.wake_both(i, j);
    return false;
}

void Contacts::begin(ContactPack& pack, const Substep& step) const
{
    Doubles reach;
    Floats normal, friction;
    Vectors<Floats> tangential;
    for (std::uint32_t l = 0; l < lanes; ++l) {
        const std::uint32_t i = pack.i[l], j = pack.j[l], k = pack.pair[l];
        reach[l] = material_.reach(i, j);
        normal[l] = impulses_.normal[k];
        friction[l] = material_.root_friction[i] * material_.root_friction[j];
        const Vec3f& before = impulses_.tangential[k];
        tangential.x[l] = before.x(), tangential.y[l] = before.y(), tangential.z[l] = before.z();
    }
    const PointPack a = gather(step.points, pack.i), b = gather(step.points, pack.j);
    const Vectors<Doubles> apart = gather(step.start, pack.i) - gather(step.start, pack.j);
    pack.reach = narrow(reach);
    pack.initial_gap = narrow(least(sqrt(dot(apart, apart)) - reach, Doubles{}));
    pack.n = narrow(directions(a.P - b.P, pack));
    pack.normal_impulse = pack.carried_impulse = 0.5f * normal;
    pack.tangential_impulse = tangential - dot(pack.n, tangential) * pack.n;
    pack.friction = friction;
    pack.effective_mass = narrow(1 / (a.w + b.w));
    scaling_.apply(pack, a, b, step);
    pack.restitution = Floats{};
    if (!material_.bounces) return;
    const Vectors<Doubles> d = a.P - b.P, u = gather(step.v, pack.i) - gather(step.v, pack.j);
    for (std::uint32_t l = 0; l < lanes; ++l) {
        pack.restitution[l] = std::max(material_.restitution[pack.i[l]], material_.restitution[pack.j[l]]);
        // No impulse separates pairs that impacts have left overlapping but separating.
        if (pack.restitution[l] > 0 && d[l].dot(u[l]) >= 0)
            pack.initial_gap[l] = std::min(pack.initial_gap[l], static_cast<float>(d[l].norm() - reach[l]));
    }
}

void Contacts::warm_start(Substep& step)
{
    if (impacts_moved_) find_contacts(step);  // some impacts are unsolved
    const auto each_point = [&](const auto& f) {
        for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) f(i);
        });
    };
    if (!rods_.empty()) sweep([&](ContactPack& pack) { limit_carried(pack, step); });
    before_.resize(step.size());
    each_point([&](std::size_t i) { before_[i] = step.points[i].P; });
    scaling_.with_weights(
        [&](const auto& weights) { sweep([&](const ContactPack& pack) { apply_warm_start(pack, step, weights); }); });
    each_point([&](std::size_t i) { step.v[i] += per_dt_ * (step.points[i].P - before_[i]); });
    if (material_.turns()) sweep([&](const ContactPack& pack) { start_spins(pack, step, impulses_.rolling); });
}

// Limits carried impulses within an island of rods. Rods keep contacts that contradict them unsatisfied in each
// substep, so the impulses would accumulate and throw the points too far for the rods to recover.
void Contacts::limit_carried(ContactPack& pack, const Substep& step) const
{
    for (std::uint32_t l = 0; l < pack.count; ++l) {
        const std::uint32_t i = pack.i[l], j = pack.j[l];
        if (!(pack.normal_impulse[l] > 0) || rods_[i] != rods_[j]) continue;
        const double distance = (step.points[i].P - step.points[j].P).norm();
        const double most = max_separation * distance * per_dt_ * pack.effective_mass[l];
        if (!(pack.normal_impulse[l] > most)) continue;
        const auto part = static_cast<float>(most / pack.normal_impulse[l]);
        pack.normal_impulse[l] *= part;
        pack.carried_impulse[l] *= part;
        for (Floats* x : {&pack.tangential_impulse.x, &pack.tangential_impulse.y, &pack.tangential_impulse.z})
            (*x)[l] *= part;
    }
}

void Contacts::project(Substep& step)
{
    const double relaxation = sleep_.sleep() ? 1 : over_relaxation;
    scaling_.with_weights([&](const auto& weights) {
        sweep([&](ContactPack& pack) { project_positions(pack, step, per_dt_, relaxation, weights); });
    });
}

void Contacts::solve_velocities(Substep& step)
{
    const bool some_asleep = sleep_.any();
    const auto part_recovered = [&](const ContactPack& pack) {
        Doubles part = Doubles{} + overlap_recovery;
        if (some_asleep)
            for (std::uint32_t l = 0; l < lanes; ++l)
                if (sleep_.asleep(pack.i[l]) || sleep_.asleep(pack.j[l])) part[l] = overlap_recovery_asleep;
        return part;
    };
    const double impact_speed = material_.bounces ? resting_speed(step) : std::numeric_limits<double>::infinity();
    scaling_.with_weights([&](const auto& weights) {
        const decltype(part_recovered)* none = nullptr;
        for (int k = 1; k < step.iterations; ++k) {
            backwards_ = !backwards_;
            sweep([&](ContactPack& pack) { solve_pack(pack, step, weights, none, impact_speed); });
        }
        backwards_ = !backwards_;
        // Skipped if light points between heavy ones and a shape would be pushed back and forth. Also skipped, like
        // over-relaxation, if points may sleep, because some piles would not come to rest.
        const bool recovers_deep = !heavy_.any() && !sleep_.sleep();
        deep_.resize(std::max(deep_.size(), blocks_.size()));
        blocks_.for_each_coloured(backwards_, [&](std::size_t b) {
            deep_[b].clear();
            in_turn(packs_[b], [&](ContactPack& pack) {
                const Doubles overlap = solve_pack(pack, step, weights, &part_recovered, impact_speed);
                if (recovers_deep && any(overlap > deep_part_of_reach * widen(pack.reach))) deep_[b].push_back(&pack);
                store(pack);
                if (heavy_.any()) HeavyContacts::pass_on_support(pack, step);
                if (!some_asleep) return;
                for_each_contact(pack,
                                 [&](const PairContact& contact) { sleep_.wake_by_load(contact, impulses_, step); });
            });
            if (backwards_) std::reverse(deep_[b].begin(), deep_[b].end());
        });
        for (int k = 0; recovers_deep && k < deep_sweeps; ++k) {
            backwards_ = !backwards_;
            blocks_.for_each_coloured(backwards_, [&](std::size_t b) {
                in_turn(deep_[b], [&](const ContactPack* pack) {
                    recover_overlaps(*pack, step, weights, part_recovered(*pack), allowed_overlaps(*pack));
                });
            });
        }
    });
}

Doubles Contacts::allowed_overlaps(const ContactPack& pack) const
{
    Doubles smaller;
    for (std::uint32_t l = 0; l < lanes; ++l)
        smaller[l] = std::min(material_.radius[pack.i[l]], material_.radius[pack.j[l]]);
    return deep_overlap * smaller;
}

template <class Weights, class Recovery>
Doubles Contacts::solve_pack(ContactPack& pack, Substep& step, const Weights& weights, const Recovery* recovery,
                             double impact_speed)
{
    if (!material_.turns()) return solve_pack_velocities<true>(pack, step, weights, recovery, impact_speed);
    const Doubles overlaps = solve_pack_velocities<false>(pack, step, weights, recovery, impact_speed);
    solve_spins(pack, step, impulses_.rolling);
    return overlaps;
}

void Contacts::store(const ContactPack& pack)
{
    for (std::uint32_t l = 0; l < pack.count; ++l) {
        impulses_.normal[pack.pair[l]] = pack.normal_impulse[l];
        impulses_.tangential[pack.pair[l]] = pack.tangential_impulse[l].cast<float>();
    }
}

std::span<const float> Contacts::recorded() const
{
    return records_ ? std::span<const float>(material_.radius) : std::span<const float>();
}

void Contacts::add_forces(const Substep& step)
{
    sweep([&](const ContactPack& pack) { add_pack_forces(pack, step); });
}

// Friction is constant throughout the substep, so its work is along the slip of the points.
void Contacts::add_pack_forces(const ContactPack& pack, const Substep& step)
{
    ContactForces& forces = *step.forces;
    for (std::uint32_t l = 0; l < pack.count; ++l) {
        if (!(pack.normal_impulse[l] > 0)) continue;
        const std::uint32_t i = pack.i[l], j = pack.j[l];
        const Vec3d slip = (step.points[i].P - step.start[i]) - (step.points[j].P - step.start[j]);
        const double work = pack.tangential_impulse[l].dot(slip) / step.dt;
        for (const std::uint32_t k : {i, j}) {
            forces.add(k, pack.normal_impulse[l], pack.tangential_impulse[l].norm());
            forces.add_work(k, 0.5 * work, 0);
            forces.count(k);
        }
    }
}

void Contacts::link(EnergyIslands& islands) const
{
    packs_.for_each([&](const PairContact& contact) {
        if (impulses_.normal[contact.pair] > 0 || contact.initial_gap < 0)
            islands.link(std::array{contact.i, contact.j});
    });
    for (const ContactPair& pair : hit_before_) islands.link(pair);
    for (std::size_t k = 0; k < hit_.size(); ++k)
        if (hit_[k]) islands.link(impulses_.pairs[k]);
}

void Contacts::correct_penetration(Substep& step)
{
    if (!heavy_.any()) return;
    sweep([&](const ContactPack& pack) {
        for_each_contact(pack, [&](const PairContact& contact) { HeavyContacts::correct(contact, material_, step); });
    });
}

void Contacts::close(Substep& step, FrameFigures& figures)
{
    const auto count = [&](std::uint32_t i, std::uint32_t j, double reach, std::uint32_t pair) {
        const double overlap = reach - (step.points[i].P - step.points[j].P).norm();
        if (!(overlap > 0) && !(impulses_.normal[pair] > 0)) return;
        ++figures.constraint_rows;
        figures.constraint_residual_max = std::max(figures.constraint_residual_max, overlap);
        if (!(overlap > violating_overlap(material_, i, j))) return;
        ++figures.loose_constraints;
        births_overlap_ |= births_[i] == Birth::Inside || births_[j] == Birth::Inside;
    };
    packs_.for_each([&](const PairContact& contact) {
        if (!sleep_.both_asleep(contact.i, contact.j)) count(contact.i, contact.j, contact.reach, contact.pair);
    });
    if (sleep_.sleep()) {
        sleep_.report(packs_, impulses_, material_, step);
        // Sleeping pairs are in no pack.
        for (std::uint32_t k = 0; k < impulses_.pairs.size(); ++k) {
            const auto [i, j] = impulses_.pairs[k];
            if (sleep_.both_asleep(i, j)) count(i, j, material_.reach(i, j), k);
        }
    }
    ContactGrids& grids = figures.contact_grids.emplace();
    for (const RadiusGrids::Grid& grid : grids_.grids) grids.points.push_back(grid.points);
    grids.error = grids_.error;
    grids.excess = grids_.excess;
    grids.search_seconds = search_seconds_;
}

namespace {

// The change of a neighbour's impulse that wakes a sleeper, relative to its burden.
constexpr double disturbing = 0.1;

// The largest overlap at which two points may fall asleep, relative to the smaller radius.
constexpr double too_deep_to_sleep = 0.05;

// Returns the impulse on i, N s.
Vec3f impulse_of(const PairContact& contact, const PairImpulses& impulses)
{
    return impulses.normal[contact.pair] * contact.n.cast<float>() + impulses.tangential[contact.pair];
}

}  // namespace

bool ContactSleep::wake_by_impact(const ContactPacks& packs, const PairImpulses& impulses,
                                  const ContactMaterial& material, Substep& step)
{
    if (!any()) return false;
    const double at_rest = resting_speed(step);
    shock_.clear();
    packs.for_each([&](const PairContact& contact) {
        const auto [i, j] = std::pair(contact.i, contact.j);
        const bool first = asleep(i);
        if (first == asleep(j)) return;
        const double closing = -contact.n.dot(step.v[i] - step.v[j]);
        if (closing < at_rest || contact.n.dot(step.points[i].P - step.points[j].P) > contact.reach) return;
        if (shock_.empty()) shock_.assign(step.size(), 0);
        const std::uint32_t hit = first ? i : j, by = first ? j : i;
        shock_[hit] = std::max(shock_[hit], closing / step.points[by].w);
    });
    if (shock_.empty()) return false;
    const auto moves = [&](std::size_t i) { return shock_[i] * sleep_->inverse_mass(i) >= at_rest; };
    for (bool spreads = true; spreads;) {
        spreads = false;
        for (const auto& [i, j] : impulses.pairs) {
            for (const auto& [from, to] : {std::pair(i, j), std::pair(j, i)}) {
                if (!(0.5 * shock_[from] > shock_[to]) || !moves(from) || !asleep(to)) continue;
                const double reach = near_contact * material.reach(i, j);
                if ((step.points[i].P - step.points[j].P).squaredNorm() > reach * reach) continue;
                shock_[to] = 0.5 * shock_[from];
                spreads |= moves(to);
            }
        }
    }
    bool woken = false;
    for (std::size_t i = 0; i < step.size(); ++i) {
        if (!asleep(i) || !moves(i)) continue;
        woken = true;
        sleep_->wake_now(i, step);
    }
    sleep_->wake_islands_now(step);
    return woken;
}

void ContactSleep::wake_by_load(const PairContact& contact, const PairImpulses& impulses, const Substep& step) const
{
    const bool first = asleep(contact.i);
    if (first == asleep(contact.j)) return;
    const std::uint32_t sleeper = first ? contact.i : contact.j;
    Vec3f change = impulse_of(contact, impulses);
    if (!impulses.resting.empty()) change -= impulses.resting[contact.pair];
    if (change.norm() > disturbing * step.dt * sleep_->burden(sleeper)) sleep_->wake(sleeper);
}

void ContactSleep::report(const ContactPacks& packs, PairImpulses& impulses, const ContactMaterial& material,
                          const Substep& step) const
{
    if (impulses.resting.empty()) impulses.resting.assign(impulses.pairs.size(), Vec3f::Zero());
    const double per_dt = 1 / step.dt;
    std::vector<std::uint8_t> deep;
    packs.for_each([&](const PairContact& contact) {
        const auto [i, j] = std::pair(contact.i, contact.j);
        if (both_asleep(i, j)) return;
        const double overlap = contact.reach - (step.points[i].P - step.points[j].P).norm();
        const Vec3f impulse = impulse_of(contact, impulses);
        for (const std::uint32_t k : {i, j}) sleep_->add_load(k, impulse.norm() * per_dt);
        if (overlap > too_deep_to_sleep * std::min(material.radius[i], material.radius[j])) {
            deep.resize(step.size());
            deep[i] = deep[j] = 1;
        }
        if (!asleep(i) && !asleep(j)) impulses.resting[contact.pair] = impulse;
    });
    if (deep.empty()) return;
    packs.for_each([&](const PairContact& contact) {
        if (!deep[contact.i] && !deep[contact.j]) return;
        for (const std::uint32_t i : {contact.i, contact.j}) sleep_->keep_awake(i);
    });
}

namespace {

// Overlap above which a contact is corrected, relative to the smaller radius.
constexpr double too_deep = 0.05;

// An overlap is stuck if a substep leaves more than this fraction of it; four fifths should have been recovered.
constexpr double stuck = 0.9;

// Mass ratio above which the iterations do not suffice.
constexpr double uneven = 2;

void pass_on(Substep& step, std::uint32_t from, std::uint32_t to)
{
    if (step.support[from] <= step.next_support[to] + 1) return;
    step.next_support[to] = step.support[from] - 1;
    if (!step.support_v.empty()) step.next_support_v[to] = step.support_v[from];
}

}  // namespace

void HeavyContacts::begin(const Substep& step)
{
    double most = 0, least = std::numeric_limits<double>::infinity();
    for (const ProjectedPoint& at : step.points)
        if (at.w > 0) most = std::max(most, at.w), least = std::min(least, at.w);
    any_ = most > uneven * least;
}

void HeavyContacts::pass_on_support(const ContactPack& pack, Substep& step)
{
    for (std::uint32_t l = 0; l < pack.count; ++l) {
        if (!(pack.normal_impulse[l] > 0)) continue;
        const std::uint32_t i = pack.i[l], j = pack.j[l];
        pass_on(step, i, j);
        pass_on(step, j, i);
    }
}

// The lighter point is a wall if it is better supported, or if the heavy one wedges it against its support. The heavy
// point also loses its velocity into the lighter one: at most its own velocity relative to the lighter one's support,
// or the resting speed. A light point that is squeezed out or thrown thus gives it no more, and a shape that lifts both
// still takes away the speed due to weight.
void HeavyContacts::correct(const PairContact& contact, const ContactMaterial& material, Substep& step)
{
    const bool first = step.points[contact.i].w < step.points[contact.j].w;  // is the heavier
    const std::uint32_t heavy = first ? contact.i : contact.j, light = first ? contact.j : contact.i;
    if (!(step.points[heavy].w > 0) || step.support[light] == 0) return;
    const Vec3d d = step.points[heavy].P - step.points[light].P;
    const double distance = d.norm(), overlap = contact.reach - distance;
    const double allowed = too_deep * std::min(material.radius[contact.i], material.radius[contact.j]);
    const double depth = overlap - allowed;
    if (!(depth > 0) || !(distance > 0)) return;
    const bool wedged = -contact.initial_gap > allowed && overlap > stuck * -contact.initial_gap &&
                        step.points[light].w > uneven * step.points[heavy].w;
    if (step.support[light] <= step.support[heavy] && !wedged) return;
    const Vec3d n = d / distance;
    step.points[heavy].P += depth * n;
    const Vec3d support = step.support_v.empty() ? Vec3d(Vec3d::Zero()) : step.support_v[light];
    const double own = -n.dot(step.v[heavy] - support), closing = n.dot(step.v[light] - step.v[heavy]);
    step.v[heavy] += std::clamp(closing, 0.0, std::max(own, resting_speed(step))) * n;
}

}  // namespace rapid
