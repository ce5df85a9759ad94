// The bound on energy: what constraints do to points in a sub-step gives them none.
//
// Rows that have not converged, warm starts that do not fit any more and corrections of positions may each leave an
// island of points with more than it had. From the velocities before (v) and after (v'), with the potential energy ΔU
// that the points' places have gained meanwhile,
//
//   v + t (v' - v),   0 <= t <= 1 the largest for which   Σ m |.|²/2 - Σ m |v|²/2 + ΔU <= 0
//
// which keeps momentum, as all points of the island take the same t. Where no t suffices, as corrections of positions
// have lifted a point or stretched a spring, the one that gives least is taken, and the rest is told. Rods and springs
// whose rest is of the size of the energy that there was have found no solution: their island moves as a rigid body
// (rigid_fallback.h), and is told.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/contact_energy.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/disjoint_sets.h"
#include "runtime/solver/constraints/rigid_fallback.h"
#include "runtime/solver/surface_potential.h"

namespace rapid {

// J: of the forces that draw a point, where these do not depend on its velocity.
inline double potential_energy(const Substep& step, std::size_t i, const Vec3d& P)
{
    if (step.mobility.empty()) return -step.acceleration.dot(P) / step.inverse_mass[i];
    const Mobility& by = step.mobility[i];
    double energy = 0.5 * by.stiffness * P.squaredNorm() - by.pull.dot(P);
    const SurfaceSpring& spring = step.surface_springs[i];
    if (spring.w2 > 0) energy += potential_energy(spring, P);
    return energy / step.inverse_mass[i];
}

// The points that rows link in a sub-step; those that something drives which moves by itself, and those that are linked
// to a place or to a point that does not move.
class EnergyIslands {
public:
    explicit EnergyIslands(const Substep& step)
        : sets_(step.size()), driven_(step.size()), anchored_(step.size()), step_(step)
    {
    }

    void link(std::span<const std::uint32_t> points);
    void drive(std::uint32_t i) { driven_[i] = 1; }

    std::uint32_t root(std::uint32_t i) { return sets_.root(i); }
    bool is_driven(std::uint32_t i) const { return driven_[i] != 0; }
    bool is_anchored(std::uint32_t i) const { return anchored_[i] != 0; }

private:
    DisjointSets sets_;
    std::vector<std::uint8_t> driven_, anchored_;
    const Substep& step_;
};

class EnergyBound {
public:
    // What the points have now. add_stored(sign, energy): adds what rows store, times the sign, to the points'
    // energies.
    template <class F>
    void begin(const Substep& step, const F& add_stored)
    {
        keep(step);
        add_stored(1.0, std::span<double>(stored_));
        for (std::size_t i = 0; i < stored_.size(); ++i) change_[i] -= stored_[i];
    }
    // J, where drag and springs act: by how much the points had more at the beginning of the sub-step. They may have it
    // back, as what acts against their motion leaves drag less to take. Rows are to be added. Once it is closed: what
    // islands could have had back, at one of their points; changes are told without it.
    std::span<double> credit() { return credit_; }
    // J: what islands that something drives have gained, or lost, when it was last closed.
    double driven() const { return driven_; }
    // What all points have gained or lost together.
    template <class F>
    ContactEnergy measure(const Substep& step, const F& add_stored)
    {
        add_potential(step);
        add_stored(1.0, std::span<double>(change_));
        return change(step);
    }
    // Limits the velocities. link(islands): links the points that rows link. fallback: where rods and springs have
    // acted; stalled() then has the points that it has moved. Returns what all have gained or lost.
    template <class F, class G>
    ContactEnergy close(Substep& step, const F& add_stored, const G& link, const RigidFallback* fallback)
    {
        add_potential(step);
        add_stored(1.0, std::span<double>(change_));
        EnergyIslands islands(step);
        link(islands);
        return limit(step, islands, fallback);
    }
    // By point: whether its island had no solution; empty where none has stalled.
    std::span<const std::uint8_t> stalled() const { return stalled_; }

private:
    struct Island {
        double slope = 0, curvature = 0;  // J: of the kinetic energy by t, at t = 0
        double change = 0;                // J, of the potential energy
        double credit = 0;                // J, what drag has taken
        double size = 0;                  // J: of what these are differences
        double available = 0;             // J, in motion, in rows, and what forces can give in the sub-step
        double part = 1;                  // t
        bool driven = false, anchored = false, stalled = false;

        double change_at(double t) const { return t * (slope + t * curvature) + change; }
    };

    void keep(const Substep& step);
    void add_potential(const Substep& step);
    ContactEnergy change(const Substep& step) const;
    ContactEnergy limit(Substep& step, EnergyIslands& islands, const RigidFallback* fallback);
    void sum_islands(const Substep& step, EnergyIslands& islands);
    ContactEnergy move_stalled(Substep& step, EnergyIslands& islands, const RigidFallback& fallback);

    std::vector<Vec3d> v_;        // m/s, before
    std::vector<Vec3d> s_;        // m/s, of spins; empty where there are none
    std::vector<double> change_;  // J, of the potential energy of each point and of the rows that are counted with it
    std::vector<double> stored_;  // J, in rows at first
    std::vector<double> credit_;  // J
    double driven_ = 0;           // J
    std::vector<std::uint8_t> stalled_;
    std::vector<Island> islands_;
};

}  // namespace rapid
