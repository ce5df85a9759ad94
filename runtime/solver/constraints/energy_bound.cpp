#include "runtime/solver/constraints/energy_bound.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/parallel.h"
#include "runtime/solver/constraints/spin.h"

namespace rapid {
namespace {

// Differences of energies are rounding below this part of them.
constexpr double rounding = 1e-12;

// Rods and springs that leave a gain above this part of the energy available have found no solution.
constexpr double largest_gain = 0.5;

template <class F>
void for_each_moving(const Substep& step, const F& f)
{
    for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (step.points[i].w > 0 && step.inverse_mass[i] > 0) f(i);
    });
}

// The largest t in [0, 1] with slope t + curvature t² + change <= 0; where there is none, that of the least.
double largest_part(double slope, double curvature, double change)
{
    const double root2 = slope * slope - 4 * curvature * change;
    if (!(curvature > 0)) return 1;
    if (!(root2 > 0)) return std::clamp(-0.5 * slope / curvature, 0.0, 1.0);
    return std::clamp((-slope + std::sqrt(root2)) / (2 * curvature), 0.0, 1.0);
}

// J: an upper bound of what forces can give a point in a sub-step, by acceleration from rest or from where it is drawn
// to.
double available_work(const Substep& step, std::size_t i)
{
    const bool own = !step.mobility.empty();
    const double stiffness = own ? step.mobility[i].stiffness : 0;
    const Vec3d a = (own ? step.mobility[i].pull : step.acceleration) - stiffness * step.points[i].P;
    double work = a.squaredNorm() * (stiffness > 0 ? 0.5 / stiffness : step.dt * step.dt);
    if (own && step.surface_springs[i].w2 > 0) work += potential_energy(step.surface_springs[i], step.points[i].P);
    return work / step.inverse_mass[i];
}

}  // namespace

// A point that does not move separates those that are linked to it, as a wall does, and drives them where it has a
// velocity.
void EnergyIslands::link(std::span<const std::uint32_t> points)
{
    const auto moves = [&](std::uint32_t i) { return step_.points[i].w > 0; };
    const auto drives = [&](std::uint32_t i) {
        return !moves(i) && (!step_.v[i].isZero(0) || (!step_.spins.empty() && !step_.spins[i].s.isZero(0)));
    };
    const bool driven = std::any_of(points.begin(), points.end(), drives);
    const bool anchored = points.size() == 1 || !std::all_of(points.begin(), points.end(), moves);
    const auto first = std::find_if(points.begin(), points.end(), moves);
    for (auto i = first; i != points.end(); ++i) {
        if (!moves(*i)) continue;
        sets_.join(*first, *i);
        if (driven) drive(*i);
        if (anchored) anchored_[*i] = 1;
    }
}

void EnergyBound::keep(const Substep& step)
{
    v_.resize(step.size());
    change_.assign(step.size(), 0.0);
    stored_.assign(step.size(), 0.0);
    credit_.assign(step.energy.size(), 0.0);
    s_.resize(step.spins.size());
    for_each_moving(step, [&](std::size_t i) {
        v_[i] = step.v[i];
        if (!s_.empty()) s_[i] = step.spins[i].s;
        change_[i] = -potential_energy(step, i, step.points[i].P);
        if (!credit_.empty())
            credit_[i] = step.energy[i] - 0.5 * v_[i].squaredNorm() / step.inverse_mass[i] + change_[i];
    });
}

void EnergyBound::add_potential(const Substep& step)
{
    for_each_moving(step, [&](std::size_t i) { change_[i] += potential_energy(step, i, step.points[i].P); });
}

ContactEnergy EnergyBound::change(const Substep& step) const
{
    double sum = 0, size = 0;
    for (std::size_t i = 0; i < step.size(); ++i) {
        if (!(step.points[i].w > 0) || !(step.inverse_mass[i] > 0)) continue;
        const double mass = 1 / step.inverse_mass[i], before = v_[i].squaredNorm(), after = step.v[i].squaredNorm();
        sum += 0.5 * mass * (after - before) + change_[i];
        size += mass * (before + after) + std::abs(change_[i]);
        if (s_.empty() || !(step.spins[i].k > 0)) continue;
        const double inertia = mass / step.spins[i].k;
        sum += 0.5 * inertia * (step.spins[i].s.squaredNorm() - s_[i].squaredNorm());
        size += inertia * (step.spins[i].s.squaredNorm() + s_[i].squaredNorm());
    }
    ContactEnergy energy;
    if (std::abs(sum) > rounding * size) energy.take(sum);
    return energy;
}

void EnergyBound::sum_islands(const Substep& step, EnergyIslands& islands)
{
    islands_.assign(step.size(), {});
    for (std::uint32_t i = 0; i < step.size(); ++i) {
        if (!(step.points[i].w > 0) || !(step.inverse_mass[i] > 0)) continue;
        Island& island = islands_[islands.root(i)];
        const Vec3d change = step.v[i] - v_[i];
        const double mass = 1 / step.inverse_mass[i];
        island.slope += mass * v_[i].dot(change);
        island.curvature += 0.5 * mass * change.squaredNorm();
        island.change += change_[i];
        island.size += mass * (v_[i].squaredNorm() + step.v[i].squaredNorm()) + std::abs(change_[i]);
        island.available += 0.5 * mass * v_[i].squaredNorm() + stored_[i] + available_work(step, i);
        if (!credit_.empty()) island.credit += credit_[i];
        island.driven |= islands.is_driven(i);
        island.anchored |= islands.is_anchored(i);
        if (s_.empty() || !(step.spins[i].k > 0)) continue;
        const Vec3d turned = step.spins[i].s - s_[i];
        const double inertia = mass / step.spins[i].k;
        island.slope += inertia * s_[i].dot(turned);
        island.curvature += 0.5 * inertia * turned.squaredNorm();
        island.size += inertia * (s_[i].squaredNorm() + step.spins[i].s.squaredNorm());
    }
}

ContactEnergy EnergyBound::limit(Substep& step, EnergyIslands& islands, const RigidFallback* fallback)
{
    sum_islands(step, islands);
    ContactEnergy energy;
    driven_ = 0;
    bool limits = false, stalls = false;
    for (Island& island : islands_) {
        island.change -= std::max(island.credit, 0.0);
        const double gain = island.change_at(1);
        if (!(std::abs(gain) > rounding * island.size)) continue;
        if (gain > 0 && !island.driven) island.part = largest_part(island.slope, island.curvature, island.change);
        limits |= island.part < 1;
        const double limited = island.change_at(island.part);
        island.stalled = fallback && !island.driven && !(limited <= largest_gain * island.available);
        stalls |= island.stalled;
        if (!island.stalled && std::abs(limited) > rounding * island.size) energy.take(limited);
        if (island.driven) driven_ += limited + std::max(island.credit, 0.0);
    }
    for (std::size_t i = 0; i < credit_.size(); ++i)
        credit_[i] = islands_[i].stalled ? 0 : std::max(islands_[i].credit, 0.0);
    stalled_.clear();
    if (limits)
        for (std::uint32_t i = 0; i < step.size(); ++i) {
            if (!(step.points[i].w > 0) || !(step.inverse_mass[i] > 0)) continue;
            const double part = islands_[islands.root(i)].part;
            if (!(part < 1)) continue;
            step.v[i] = v_[i] + part * (step.v[i] - v_[i]);
            if (!s_.empty()) step.spins[i].s = s_[i] + part * (step.spins[i].s - s_[i]);
        }
    if (stalls) energy += move_stalled(step, islands, *fallback);
    return energy;
}

ContactEnergy EnergyBound::move_stalled(Substep& step, EnergyIslands& islands, const RigidFallback& fallback)
{
    std::map<std::uint32_t, std::vector<std::uint32_t>> points;
    stalled_.assign(step.size(), 0);
    for (std::uint32_t i = 0; i < step.size(); ++i) {
        if (!(step.points[i].w > 0) || !(step.inverse_mass[i] > 0) || !islands_[islands.root(i)].stalled) continue;
        points[islands.root(i)].push_back(i);
        stalled_[i] = 1;
    }
    ContactEnergy energy;
    for (const auto& [root, of_island] : points) energy.take(fallback.apply(step, of_island, islands_[root].anchored));
    return energy;
}

}  // namespace rapid
