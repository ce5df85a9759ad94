// Sequential impulses for a pack of contacts: warm start, projection of positions, restitution and friction.
//
// weights: see MassScaling::with_weights().
#pragma once

#include "runtime/solver/constraints/contact_pack.h"
#include "runtime/solver/constraints/point_pack.h"

namespace rapid {

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

// The gap is to be no less than at the beginning of the sub-step, nor than 0.
template <class Weights>
[[gnu::always_inline]] inline void project_positions(ContactPack& pack, Substep& step, double per_dt,
                                                     const Weights& weights)
{
    PointPack a = gather(step.points, pack.i), b = gather(step.points, pack.j);
    const auto [wa, wb] = weights(pack, a, b);
    const Vectors<Doubles> n = widen(pack.n);
    const Doubles before = widen(pack.normal_impulse);
    const Doubles C = dot(n, a.P - b.P) - widen(pack.reach) - widen(pack.initial_gap);
    const Doubles impulse = most(before - C * per_dt * widen(pack.effective_mass), Doubles{});
    const Doubles change = step.dt * (impulse - before);
    pack.normal_impulse = narrow(impulse);
    a.P += (wa * change) * n;
    b.P -= (wb * change) * n;
    scatter(a, step.points, pack.i, pack.count);
    scatter(b, step.points, pack.j, pack.count);
}

// Normal velocities first: none into the other point, or that of restitution; then Coulomb friction by the whole normal
// impulse. Friction acts throughout the sub-step, and so half of it on positions: else a point that is held would
// creep. recovery(pack): which part of an overlap is taken away; null but in the last iteration.
template <class Weights, class Recovery>
[[gnu::always_inline]] inline void solve_pack_velocities(ContactPack& pack, Substep& step, const Weights& weights,
                                                         const Recovery* recovery)
{
    // As a part of the sum of the radii, an overlap that is left: a contact that is just lost is found again in the
    // next sub-step, and that is jitter.
    constexpr double slop = 1e-4;

    PointPack a = gather(step.points, pack.i), b = gather(step.points, pack.j);
    const Vectors<Doubles> n = widen(pack.n), tangential_before = widen(pack.tangential_impulse);
    const Doubles before = widen(pack.normal_impulse) + widen(pack.carried_impulse), reach = widen(pack.reach);
    const Doubles overlap = reach - dot(n, a.P - b.P), mass = widen(pack.effective_mass);
    Vectors<Doubles> va = gather(step.v, pack.i), vb = gather(step.v, pack.j);

    const Vectors<Doubles> relative = va - vb;
    const Doubles normal_velocity = dot(n, relative);
    const Flags touches = (before > 0) | (overlap > 0);
    const Doubles normal =
        touches ? most(before + (widen(pack.rebound) - normal_velocity) * mass, Doubles{}) : Doubles{};
    const Vectors<Doubles> sticking = tangential_before - mass * (relative - normal_velocity * n);
    const Doubles size = sqrt(dot(sticking, sticking)), bound = widen(pack.friction) * normal;
    const Vectors<Doubles> tangential = (bound < size ? bound / size : Doubles{} + 1) * sticking;
    const Vectors<Doubles> change = tangential - tangential_before;
    pack.normal_impulse = narrow(normal);
    pack.tangential_impulse = narrow(tangential);
    pack.carried_impulse = Floats{};

    const Vectors<Doubles> impulse = (normal - before) * n + change;
    Vectors<Doubles> shift = (0.5 * step.dt) * change;
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
}

}  // namespace rapid
