#include "runtime/solver/ledger.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/spin.h"

namespace rapid {

double EnergyChanges::sum() const
{
    const double apart = split ? split->friction + split->shapes : 0;
    return rods + contacts + pins + drag + apart;
}

EnergyChanges& EnergyChanges::operator+=(const EnergyChanges& other)
{
    rods += other.rods;
    contacts += other.contacts;
    pins += other.pins;
    drag += other.drag;
    if (split && other.split)
        split->friction += other.split->friction, split->shapes += other.split->shapes;
    else
        split.reset();
    return *this;
}

void Ledger::append(const Ledger& later)
{
    const Ledger before = *this;
    *this = later;
    by += before.by;
    by_motion += before.by_motion;
    if (!before.residue || !residue) return residue.reset();
    residue->energy = std::max(residue->energy, before.residue->energy);
    residue->momentum = std::max(residue->momentum, before.residue->momentum);
    residue->angular_momentum = std::max(residue->angular_momentum, before.residue->angular_momentum);
}

LedgerState LedgerState::of(const Substep& step, double elastic)
{
    LedgerState state;
    state.elastic = elastic;
    // m/s per metre: the effect of rounded positions on velocities in some tens of substeps. If it exceeds the largest
    // residue of the speeds, no residue can be reported.
    const double rounding = step.dt > 0 ? 8 * std::numeric_limits<double>::epsilon() / step.dt : 0;
    const auto each = [&](const auto& f) {
        for (std::size_t i = 0; i < step.size(); ++i)
            if (step.inverse_mass[i] > 0 && step.lives(i)) f(1 / step.inverse_mass[i], step.points[i].P, step.v[i]);
    };
    each([&](double m, const Vec3d& P, const Vec3d& v) {
        state.mass += m;
        state.kinetic += 0.5 * m * v.squaredNorm();
        state.potential -= m * step.acceleration.dot(P);
        state.center += m * P;
        state.momentum += m * v;
        state.angular_momentum += m * P.cross(v);
        state.speed += m * (v.norm() + rounding / largest_residue * P.norm());
    });
    for (std::size_t i = 0; i < step.spins.size(); ++i)
        if (step.inverse_mass[i] > 0 && step.lives(i)) {
            state.kinetic += step.spins[i].kinetic_energy(1 / step.inverse_mass[i]);
            state.angular_momentum += step.spins[i].angular_momentum(1 / step.inverse_mass[i]);
        }
    if (!(state.mass > 0)) return state;
    const Vec3d center = state.center / state.mass;
    each([&](double m, const Vec3d& P, const Vec3d& v) { state.turning += m * (P - center).norm() * v.norm(); });
    return state;
}

Ledger ledger_of(const LedgerState& before, const LedgerState& after, const EnergyChanges& by, bool is_isolated,
                 const Vec3d& a, double h)
{
    Ledger ledger;
    ledger.kinetic = after.kinetic, ledger.potential = after.potential, ledger.elastic = after.elastic;
    ledger.by = by;
    ledger.by_motion = after.energy() - before.energy() - by.sum();
    ledger.momentum = after.momentum, ledger.angular_momentum = after.angular_momentum;
    if (!is_isolated) return ledger;
    const auto part = [](double residue, double whole) { return whole > 0 ? residue / whole : 0; };
    const double speed = std::max(before.speed, after.speed) + before.mass * a.norm() * h;
    const Vec3d pull = before.mass * h * a, torque = (h * before.center + 0.5 * h * h * before.momentum).cross(a);
    const double energy = std::max(before.kinetic, after.kinetic) + std::max(before.elastic, after.elastic) +
                          std::abs(after.potential - before.potential);
    // Breaking rows remove their stored energy.
    ledger.residue = {part(std::max(0.0, ledger.by_motion), energy),
                      part((after.momentum - before.momentum - pull).norm(), speed),
                      part((after.angular_momentum - before.angular_momentum - torque).norm(),
                           std::max(before.turning, after.turning) + torque.norm())};
    return ledger;
}

}  // namespace rapid
