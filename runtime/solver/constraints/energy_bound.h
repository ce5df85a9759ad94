// The bound on energy: what constraints do to points in a sub-step gives them none.
//
// Rows that have not converged, warm starts that do not fit any more and corrections of positions may each leave an
// island of points with more than it had. From the velocities before (v) and after (v'), with the potential energy ΔU
// that the points' places have gained meanwhile,
//
//   v + t (v' - v),   0 <= t <= 1 the largest for which   Σ m |.|²/2 - Σ m |v|²/2 + ΔU <= 0
//
// which keeps momentum, as all points of the island take the same t. Where no t suffices, as corrections of positions
// have lifted a point or stretched a spring, the one that gives least is taken, and the rest is told.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/contact_energy.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/disjoint_sets.h"

namespace rapid {

// J: of the forces that draw a point, where these do not depend on its velocity.
inline double potential_energy(const Substep& step, std::size_t i, const Vec3d& P)
{
    const bool own = !step.mobility.empty();
    const Vec3d& pull = own ? step.mobility[i].pull : step.acceleration;
    const double stiffness = own ? step.mobility[i].stiffness : 0;
    return (0.5 * stiffness * P.squaredNorm() - pull.dot(P)) / step.inverse_mass[i];
}

// The points that rows link in a sub-step, and those that something drives which moves by itself.
class EnergyIslands {
public:
    explicit EnergyIslands(const Substep& step) : sets_(step.size()), driven_(step.size()), step_(step) {}

    void link(std::span<const std::uint32_t> points);
    void drive(std::uint32_t i) { driven_[i] = 1; }

    std::uint32_t root(std::uint32_t i) { return sets_.root(i); }
    bool is_driven(std::uint32_t i) const { return driven_[i] != 0; }

private:
    DisjointSets sets_;
    std::vector<std::uint8_t> driven_;
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
        add_stored(-1.0, std::span<double>(change_));
    }
    // J, where drag and springs act: by how much the points had more at the beginning of the sub-step. They may have it
    // back, as what acts against their motion leaves drag less to take. Rows are to be added.
    std::span<double> credit() { return credit_; }
    // What all points have gained or lost together.
    template <class F>
    ContactEnergy measure(const Substep& step, const F& add_stored)
    {
        add_potential(step);
        add_stored(1.0, std::span<double>(change_));
        return change(step);
    }
    // Limits the velocities. link(islands): links the points that rows link. Returns what they have gained or lost.
    template <class F, class G>
    ContactEnergy close(Substep& step, const F& add_stored, const G& link)
    {
        add_potential(step);
        add_stored(1.0, std::span<double>(change_));
        EnergyIslands islands(step);
        link(islands);
        return limit(step, islands);
    }

private:
    struct Island {
        double slope = 0, curvature = 0;  // J: of the kinetic energy by t, at t = 0
        double change = 0;                // J, of the potential energy
        double credit = 0;                // J, what drag has taken
        double size = 0;                  // J: of what these are differences
        double part = 1;                  // t
        bool driven = false;
    };

    void keep(const Substep& step);
    void add_potential(const Substep& step);
    ContactEnergy change(const Substep& step) const;
    ContactEnergy limit(Substep& step, EnergyIslands& islands);

    std::vector<Vec3d> v_;        // m/s, before
    std::vector<double> change_;  // J, of the potential energy of each point and of the rows that are counted with it
    std::vector<double> credit_;  // J
    std::vector<Island> islands_;
};

}  // namespace rapid
