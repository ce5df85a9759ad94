// Sequential impulses for a pack of contacts: impacts, warm start, position projection, velocities and friction.
//
// weights: see MassScaling::with_weights().
#pragma once

#include "runtime/solver/constraints/contact_forces.h"
#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/constraints/impact.h"
#include "runtime/solver/constraints/spin.h"

namespace rapid {

// Solves the contact in one lane. Returns true if it was an impact.
inline bool solve_impact(const ContactPack& pack, std::uint32_t l, Substep& step, double at_rest, std::uint32_t sweep)
{
    const std::uint32_t i = pack.i[l], j = pack.j[l];
    const double wi = impact_inverse_mass(step, i), wj = impact_inverse_mass(step, j);
    const double longest = std::min(wi > 0 ? step.paths[i].since : step.dt, wj > 0 ? step.paths[j].since : step.dt);
    const Vec3d acceleration = path_acceleration(step, i) - path_acceleration(step, j);
    const Vec3d end = step.points[i].P - step.points[j].P;
    Vec3d d = end, u = step.v[i] - step.v[j];
    double since = 0;
    for (int k = 0; k < path_iterations; ++k) {
        const Vec3d mean = u - 0.5 * since * acceleration;
        const std::optional<double> found = time_of_impact(end, mean, pack.reach[l], longest);
        if (!found) return false;
        since = *found;
        d = end - since * mean;
    }
    u -= since * acceleration;
    const double distance = d.norm();
    if (!(distance > 0) || !(u.dot(d) < -at_rest * distance)) return false;
    const Vec3d n = d / distance;
    const Vec3d impulse =
        step.spins.empty()
            ? impact_impulse(n, u, 1 / (wi + wj), pack.restitution[l], pack.friction[l])
            : spinning_impact(step, i, j, n, u, distance / pack.reach[l], pack.restitution[l], pack.friction[l]);
    if (step.forces) {
        const Vec3d friction = impulse - n.dot(impulse) * n;
        const double work = friction.dot(u + 0.5 * (wi + wj) * friction);
        for (const std::uint32_t k : {i, j}) step.forces->add(k, n, impulse), step.forces->add_work(k, 0.5 * work, 0);
    }
    take_impulse(step, i, impulse, since, sweep);
    take_impulse(step, j, -impulse, since, sweep);
    return true;
}

// Solves contacts that close faster than resting contacts, and marks them in `hits`, by pair. Returns false if there
// are none, which a quick test shows for most packs.
inline bool solve_impacts(const ContactPack& pack, Substep& step, double at_rest, std::uint32_t sweep,
                          std::span<std::uint8_t> hits)
{
    const PointPack a = gather(step.points, pack.i), b = gather(step.points, pack.j);
    const Vectors<Doubles> d = a.P - b.P, u = gather(step.v, pack.i) - gather(step.v, pack.j);
    const Doubles farthest = near_contact * widen(pack.reach);
    std::uint32_t may_hit =
        bits((widen(pack.restitution) > 0) & (dot(d, d) < farthest * farthest) & (dot(u, u) > at_rest * at_rest));
    bool hit = false;
    for (; may_hit != 0; may_hit &= may_hit - 1) {
        const auto l = static_cast<std::uint32_t>(std::countr_zero(may_hit));
        if (l >= pack.count || !solve_impact(pack, l, step, at_rest, sweep)) continue;
        hits[pack.pair[l]] = 1;
        hit = true;
    }
    return hit;
}

template <class Weights>
[[gnu::always_inline]] inline void apply_warm_start(const ContactPack& pack, Substep& step, const Weights& weights)
{
    if (!any(widen(pack.normal_impulse) > 0)) return;
    PointPack a = gather(step.points, pack.i), b = gather(step.points, pack.j);
    const auto [wa, wb] = weights(pack, a, b);
    const double dt = step.dt;
    const Vectors<Doubles> half = widen(pack.normal_impulse * pack.n + 0.5f * pack.tangential_impulse);
    a.P += (wa * dt) * half;
    b.P -= (wb * dt) * half;
    scatter(a, step.points, pack.i, pack.count);
    scatter(b, step.points, pack.j, pack.count);
}

// Keeps the gap at its value from the beginning of the substep, or at 0 if it was open. relaxation: above 1 more than
// one contact alone needs, because others will push against it (successive over-relaxation); the velocity sweep takes
// any excess back.
template <class Weights>
[[gnu::always_inline]] inline void project_positions(ContactPack& pack, Substep& step, double per_dt, double relaxation,
                                                     const Weights& weights)
{
    PointPack a = gather(step.points, pack.i), b = gather(step.points, pack.j);
    const auto [wa, wb] = weights(pack, a, b);
    const Vectors<Doubles> n = widen(pack.n);
    const Doubles before = widen(pack.normal_impulse);
    const Doubles C = dot(n, a.P - b.P) - widen(pack.reach) - widen(pack.initial_gap);
    const Doubles impulse = most(before - (relaxation * per_dt) * C * widen(pack.effective_mass), Doubles{});
    const Doubles change = step.dt * (impulse - before);
    pack.normal_impulse = narrow(impulse);
    a.P += (wa * change) * n;
    b.P -= (wb * change) * n;
    scatter(a, step.points, pack.i, pack.count);
    scatter(b, step.points, pack.j, pack.count);
}

// Solves normal velocities first, so that no point moves into the other, then Coulomb friction from the total normal
// impulse. Friction acts throughout the substep, so half of it also moves positions; otherwise a held point would
// creep. recovery(pack): the fraction of an overlap to remove; null except in the last iteration. impact_speed:
// bouncing pairs that recovery pushes into one another, and that close faster than this, are left to the impacts of
// the next substep; infinite if none bounce. frictional: false if points turn, since friction is then solved
// separately (spin.h). Returns the overlaps before the call.
template <bool frictional, class Weights, class Recovery>
[[gnu::always_inline]] inline Doubles solve_pack_velocities(ContactPack& pack, Substep& step, const Weights& weights,
                                                            const Recovery* recovery, double impact_speed)
{
    // The overlap that is left, as a fraction of the sum of the radii. A contact that is barely lost is found again in
    // the next substep, which causes jitter.
    constexpr double slop = 1e-4;

    PointPack a = gather(step.points, pack.i), b = gather(step.points, pack.j);
    const Vectors<Doubles> n = widen(pack.n), tangential_before = widen(pack.tangential_impulse);
    const Doubles before = widen(pack.normal_impulse) + widen(pack.carried_impulse), reach = widen(pack.reach);
    const Doubles overlap = reach - dot(n, a.P - b.P), mass = widen(pack.effective_mass);
    Vectors<Doubles> va = gather(step.v, pack.i), vb = gather(step.v, pack.j);

    const Vectors<Doubles> relative = va - vb;
    const Doubles normal_velocity = dot(n, relative);
    Flags touches = (before > 0) | (overlap > 0);
    if (std::isfinite(impact_speed))
        touches &= (before > 0) | (widen(pack.restitution) <= 0) | (normal_velocity >= -impact_speed);
    const Doubles normal = touches ? most(before - normal_velocity * mass, Doubles{}) : Doubles{};
    Vectors<Doubles> impulse = (normal - before) * n, shift{};
    if constexpr (frictional) {
        const Vectors<Doubles> sticking = tangential_before - mass * (relative - normal_velocity * n);
        const Doubles size = sqrt(dot(sticking, sticking)), bound = widen(pack.friction) * normal;
        const Vectors<Doubles> tangential = (bound < size ? bound / size : Doubles{} + 1) * sticking;
        const Vectors<Doubles> change = tangential - tangential_before;
        pack.tangential_impulse = narrow(tangential);
        impulse += change;
        shift = (0.5 * step.dt) * change;
    }
    pack.normal_impulse = narrow(normal);
    pack.carried_impulse = Floats{};
    const auto [wa, wb] = weights(pack, a, b);
    va += wa * impulse;
    vb -= wb * impulse;
    if (recovery) shift += ((*recovery)(pack)*most(overlap - slop * reach, Doubles{}) * mass) * n;
    a.P += wa * shift;
    b.P -= wb * shift;
    scatter(a, step.points, pack.i, pack.count);
    scatter(b, step.points, pack.j, pack.count);
    scatter(va, step.v, pack.i, pack.count);
    scatter(vb, step.v, pack.j, pack.count);
    return overlap;
}

// Removes this fraction of the overlaps beyond `allowed` without adding speed.
template <class Weights>
[[gnu::always_inline]] inline void recover_overlaps(const ContactPack& pack, Substep& step, const Weights& weights,
                                                    const Doubles& part, const Doubles& allowed)
{
    PointPack a = gather(step.points, pack.i), b = gather(step.points, pack.j);
    const Vectors<Doubles> n = widen(pack.n);
    const Doubles beyond = widen(pack.reach) - allowed - dot(n, a.P - b.P);
    if (!any(beyond > 0)) return;
    const auto [wa, wb] = weights(pack, a, b);
    const Vectors<Doubles> shift = (part * most(beyond, Doubles{}) * widen(pack.effective_mass)) * n;
    a.P += wa * shift;
    b.P -= wb * shift;
    scatter(a, step.points, pack.i, pack.count);
    scatter(b, step.points, pack.j, pack.count);
}

}  // namespace rapid
