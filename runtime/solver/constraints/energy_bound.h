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
//
// What moves by itself, as pins and shapes do, gives energy. Seen from the frame that goes along with it, at V with the
// acceleration A, it gives none: there the same holds of Σ m |v - V|²/2, and of U + Σ m A·P. Where an island has
// several drivers, V is their mean, and what they may give besides is what a wall at the greatest difference from it
// would,
//
//   Σ 2 m s (|v - V| + s),   s = max |V_k - V|
//
// Drag and springs to places are at rest in the world, and give points that they hold back otherwise than in their free
// motion the energy |V| times the difference of their impulses at most; springs to surfaces that of their velocity from
// V.
#pragma once

#include <cstdint>
#include <optional>
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

// What drives points: its velocity at the end of the sub-step, m/s, and its way in it, m, jumps aside.
struct Drive {
    Vec3d v = Vec3d::Zero(), way = Vec3d::Zero();

    static Drive of(const Vec3d& v_before, const Vec3d& v, double dt) { return {v, 0.5 * dt * (v_before + v)}; }

    Vec3d acceleration(double dt) const { return 2 / (dt * dt) * (dt * v - way); }
};

// The points that rows link in a sub-step; and what they are linked to that no row moves, at rest or not.
class EnergyIslands {
public:
    explicit EnergyIslands(const Substep& step) : sets_(step.size()), step_(step) {}

    void link(std::span<const std::uint32_t> points);
    // rolling: m/s, what turns a point gives its surface besides.
    void drive(std::uint32_t i, const Drive& by, double rolling = 0) { drivers_.push_back({i, none, by, rolling}); }
    // How a point goes that no row moves, where not at its velocity throughout.
    void move(std::uint32_t i, const Drive& by)
    {
        kinematic_.resize(step_.size());
        kinematic_[i] = by;
    }
    // Once all are linked.
    void close();

    struct Driven {
        Drive mean;
        double spread = 0;          // m/s, of the drivers about it
        std::uint32_t drivers = 0;  // 0: none; nothing holds the island, either
        bool moves = false;         // one of them does
    };

    std::uint32_t root(std::uint32_t i) { return sets_.root(i); }
    // Of the island of a root.
    const Driven& driven(std::uint32_t root) const { return driven_[root]; }
    bool any_moves() const { return any_moves_; }

private:
    static constexpr std::uint32_t none = ~0u;
    struct Driver {
        std::uint32_t i, point;  // of the island; that drives it, or none
        Drive by;
        double rolling;
    };

    DisjointSets sets_;
    const Substep& step_;
    std::vector<Driver> drivers_;
    std::vector<std::optional<Drive>> kinematic_;  // by point; empty where none is told
    std::vector<Driven> driven_;
    bool any_moves_ = false;
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
    // J: what rows store at first, seen from what drives them, where that differs. Valid once it has begun.
    std::span<double> stored_in_frame()
    {
        stored_in_frame_.assign(stored_.size(), 0.0);
        return stored_in_frame_;
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
        islands.close();
        ContactEnergy energy = limit(step, islands, fallback);
        if (stalled_.empty()) return energy;
        move_stalled(step, islands, *fallback);
        add_stored(1.0, std::span<double>(change_));
        return energy += stalled_change(islands);
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
        double given = 0;                 // J: what drivers, drag and springs to places give at most, in the frame
        double part = 1;                  // t
        bool stalled = false;

        double change_at(double t) const { return t * (slope + t * curvature) + change; }
    };

    void keep(const Substep& step);
    void add_potential(const Substep& step);
    ContactEnergy change(const Substep& step) const;
    ContactEnergy limit(Substep& step, EnergyIslands& islands, const RigidFallback* fallback);
    void sum_islands(const Substep& step, EnergyIslands& islands);
    void add(const Substep& step, std::uint32_t i, Island& island) const;
    void add_seen(const Substep& step, std::uint32_t i, const EnergyIslands::Driven& by, Island& island) const;
    void add_turning(const Substep& step, std::uint32_t i, Island& island) const;
    // Moves stalled islands; change_ then has what their points have gained, without rows.
    void move_stalled(Substep& step, EnergyIslands& islands, const RigidFallback& fallback);
    ContactEnergy stalled_change(EnergyIslands& islands);

    std::vector<Vec3d> v_;        // m/s, before
    std::vector<Vec3d> P_;        // m, before
    std::vector<Vec3d> s_;        // m/s, of spins; empty where there are none
    std::vector<double> change_;  // J, of the potential energy of each point and of the rows that are counted with it
    std::vector<double> stored_;  // J, in rows at first
    std::vector<double> stored_in_frame_;  // J; empty where that is the same
    std::vector<double> credit_;           // J
    double driven_ = 0;                    // J
    std::vector<std::uint8_t> stalled_;
    std::vector<Island> islands_, seen_;  // in the world; from drivers that move, empty where none does
};

}  // namespace rapid
