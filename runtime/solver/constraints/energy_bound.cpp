#include "runtime/solver/constraints/energy_bound.h"

#include <algorithm>
#include <cmath>

#include "runtime/parallel.h"

namespace rapid {
namespace {

// Differences of energies are rounding below this part of them.
constexpr double rounding = 1e-12;

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

}  // namespace

// A point that does not move separates those that are linked to it, as a wall does, and drives them where it has a
// velocity.
void EnergyIslands::link(std::span<const std::uint32_t> points)
{
    const auto moves = [&](std::uint32_t i) { return step_.points[i].w > 0; };
    const bool driven =
        std::any_of(points.begin(), points.end(), [&](std::uint32_t i) { return !moves(i) && !step_.v[i].isZero(0); });
    const auto first = std::find_if(points.begin(), points.end(), moves);
    for (auto i = first; i != points.end(); ++i) {
        if (!moves(*i)) continue;
        sets_.join(*first, *i);
        if (driven) drive(*i);
    }
}

void EnergyBound::keep(const Substep& step)
{
    v_.resize(step.size());
    change_.assign(step.size(), 0.0);
    credit_.assign(step.energy.size(), 0.0);
    for_each_moving(step, [&](std::size_t i) {
        v_[i] = step.v[i];
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
    }
    ContactEnergy energy;
    if (std::abs(sum) > rounding * size) energy.take(sum);
    return energy;
}

ContactEnergy EnergyBound::limit(Substep& step, EnergyIslands& islands)
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
        if (!credit_.empty()) island.credit += credit_[i];
        island.driven |= islands.is_driven(i);
    }
    ContactEnergy energy;
    bool limits = false;
    for (Island& island : islands_) {
        island.change -= std::max(island.credit, 0.0);
        const double gain = island.slope + island.curvature + island.change;
        if (!(std::abs(gain) > rounding * island.size)) continue;
        if (gain > 0 && !island.driven) island.part = largest_part(island.slope, island.curvature, island.change);
        limits |= island.part < 1;
        const double limited = island.part * (island.slope + island.part * island.curvature) + island.change;
        if (std::abs(limited) > rounding * island.size) energy.take(limited);
    }
    if (!limits) return energy;
    for (std::uint32_t i = 0; i < step.size(); ++i) {
        if (!(step.points[i].w > 0) || !(step.inverse_mass[i] > 0)) continue;
        const double part = islands_[islands.root(i)].part;
        if (part < 1) step.v[i] = v_[i] + part * (step.v[i] - v_[i]);
    }
    return energy;
}

}  // namespace rapid
