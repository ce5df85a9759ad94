// The energy bound: constraints add no energy to points in a substep.
//
// Unconverged rows, outdated warm starts and position corrections may each leave an island of points with more energy
// than it had. With the velocities before (v) and after (v'), and the increase ΔU in the potential energy of the
// points' positions, the bound sets the velocities to
//
//   v + t (v' - v),   0 <= t <= 1 the largest for which   Σ m |.|²/2 - Σ m |v|²/2 + ΔU <= 0
//
// This conserves momentum, because all points of the island share t. If no t suffices, because position corrections
// lifted a point or stretched a spring, the t with the least gain is taken and the rest is reported. Rods and springs
// have found no solution if that rest is of the order of the initial energy. Their island then moves as a rigid body
//, and this is reported.
//
// Drivers such as pins and shapes move by themselves and supply energy. They supply none in the frame that moves along
// with them, at V with the acceleration A: there, the same bound holds for Σ m |v - V|²/2 and U + Σ m A·P. If an
// island has several drivers, V is their mean, and their additional supply is bounded by that of a wall at the largest
// difference from V,
//
//   Σ 2 m s (|v - V| + s),   s = max |V_k - V|
//
// Drag and springs to fixed positions are at rest in the world. If they hold points back differently than in free
// motion, they supply at most |V| times the difference of their impulses. The bound for springs to surfaces is the same
// with the surface's speed relative to V.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/disjoint_sets.h"
#include "runtime/solver/surface_springs.h"

namespace rapid {

// The fallback if rods and springs find no solution in a substep: the points that they link move as one rigid body.
//
// From the points' positions at the beginning of the substep,
//
//   x' = x + d,   v' = V + ω × (x - X)
//
// with d the mean displacement of their free motion, X and V the position and velocity of their centre of mass, and ω
// from their angular momentum. Both momenta are conserved, as is the energy stored in rows, because no distance
// changes. All kinetic energy beyond that of the rigid body is lost. The positions do not turn within the substep: with
// the same ω, turned positions would have another angular momentum. Points linked to something that no row moves follow
// it. Points on springs follow the mean motion of the positions or surfaces that the springs attach to.

struct Drive;

class RigidFallback {
public:
    // Stores the positions at the beginning of the substep and those after free motion.
    void begin(const Substep& step);
    // Moves the given points, which rows link, and discards the rows' result. driver: holds some of them; null if
    // there is none.
    void apply(Substep& step, std::span<const std::uint32_t> points, const Drive* driver) const;

private:
    std::optional<Drive> resting_position(const Substep& step, std::span<const std::uint32_t> points) const;
    void carry(Substep& step, std::span<const std::uint32_t> points, const Drive& driver) const;
    void move(Substep& step, std::span<const std::uint32_t> points) const;
    void place(Substep& step, std::uint32_t i, const Vec3d& P, const Vec3d& v) const;

    std::vector<Vec3d> start_, P_, v_;
};

// Returns the potential energy of the velocity-independent forces on a point, J.
inline double potential_energy(const Substep& step, std::size_t i, const Vec3d& P)
{
    if (step.mobility.empty()) return -step.acceleration.dot(P) / step.inverse_mass[i];
    const Mobility& by = step.mobility[i];
    double energy = 0.5 * by.stiffness * P.squaredNorm() - by.pull.dot(P);
    const SurfaceSpring& spring = step.surface_springs[i];
    if (spring.w2 > 0) energy += potential_energy(spring, P);
    return energy / step.inverse_mass[i];
}

// Motion of a driver: its velocity at the end of the substep, m/s, and its displacement over the substep, m, without
// jumps.
struct Drive {
    Vec3d v = Vec3d::Zero(), displacement = Vec3d::Zero();

    static Drive of(const Vec3d& v_before, const Vec3d& v, double dt) { return {v, 0.5 * dt * (v_before + v)}; }

    Vec3d acceleration(double dt) const { return 2 / (dt * dt) * (dt * v - displacement); }
};

// Islands of points linked by rows in a substep, with the moving or resting drivers that they are linked to.
class EnergyIslands {
public:
    explicit EnergyIslands(const Substep& step) : sets_(step.size()), step_(step) {}

    void link(std::span<const std::uint32_t> points);
    // rolling: m/s, the additional surface speed of a turning point.
    void drive(std::uint32_t i, const Drive& by, double rolling = 0) { drivers_.push_back({i, none, by, rolling}); }
    // Sets the motion of a point that no row moves, if it is not uniform.
    void move(std::uint32_t i, const Drive& by)
    {
        kinematic_.resize(step_.size());
        kinematic_[i] = by;
    }
    // Closes the islands after all points are linked.
    void close();

    struct Driven {
        Drive mean;
        double spread = 0;          // m/s, of the drivers around the mean
        std::uint32_t drivers = 0;  // 0: nothing drives or holds the island
        bool moves = false;         // one of the drivers moves
    };

    std::uint32_t root(std::uint32_t i) { return sets_.root(i); }
    // Returns the drivers of the island with this root.
    const Driven& driven(std::uint32_t root) const { return driven_[root]; }
    bool any_moves() const { return any_moves_; }

private:
    static constexpr std::uint32_t none = ~0u;
    struct Driver {
        std::uint32_t i, point;  // a point of the island; its driver, or none
        Drive by;
        double rolling;
    };

    DisjointSets sets_;
    const Substep& step_;
    std::vector<Driver> drivers_;
    std::vector<std::optional<Drive>> kinematic_;  // by point; empty if none was set
    std::vector<Driven> driven_;
    bool any_moves_ = false;
};

class EnergyBound {
public:
    // Records the initial state. add_stored(sign, energy) adds the energy stored in rows, times the sign, to the
    // points' energies.
    template <class F>
    void begin(const Substep& step, const F& add_stored)
    {
        keep(step);
        add_stored(1.0, std::span<double>(stored_));
        for (std::size_t i = 0; i < stored_.size(); ++i) change_[i] -= stored_[i];
    }
    // Returns, for filling, the energy stored in rows at first as seen from their drivers, J, if it differs. Valid
    // after begin().
    std::span<double> stored_in_frame()
    {
        stored_in_frame_.assign(stored_.size(), 0.0);
        return stored_in_frame_;
    }
    // Returns, J, how much more energy points had at the beginning of the substep while drag and springs act. Points
    // may regain it, because a force against their motion leaves drag less to take. Callers add the rows' part. After
    // close(), it holds at one point of each island the energy that the island could have regained; reported changes
    // exclude it.
    std::span<double> credit() { return credit_; }
    // Returns the energy that driven islands gained or lost in the last close(), J.
    double driven() const { return driven_; }
    // Returns the total gain or loss of all points.
    template <class F>
    ContactEnergy measure(const Substep& step, const F& add_stored)
    {
        add_potential(step);
        add_stored(1.0, std::span<double>(change_));
        return change(step);
    }
    // Limits the velocities. link(islands) links the points that rows link. fallback: not null if rods and springs
    // acted; stalled() then marks the points that it moved. Returns the total gain or loss.
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
    // Marks by point whether its island had no solution; empty if none stalled.
    std::span<const std::uint8_t> stalled() const { return stalled_; }

private:
    struct Island {
        double slope = 0, curvature = 0;  // J: coefficients of the kinetic energy in t, from t = 0
        double change = 0;                // J, of the potential energy
        double credit = 0;                // J, taken by drag
        double size = 0;                  // J: magnitude of the terms, which cancel
        double available = 0;             // J: kinetic, stored in rows, and the most that forces can supply
        double given = 0;                 // J: bound on the supply of drivers, drag and springs, in the frame
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
    // Moves stalled islands. change_ then holds their points' gain, without rows.
    void move_stalled(Substep& step, EnergyIslands& islands, const RigidFallback& fallback);
    ContactEnergy stalled_change(EnergyIslands& islands);

    std::vector<Vec3d> v_;                 // m/s, before
    std::vector<Vec3d> P_;                 // m, before
    std::vector<Vec3d> s_;                 // m/s, of spins; empty if there are none
    std::vector<double> change_;           // J: potential energy of each point and of the rows counted with it
    std::vector<double> stored_;           // J, initially in rows
    std::vector<double> stored_in_frame_;  // J; empty if equal to stored_
    std::vector<double> credit_;           // J
    double driven_ = 0;                    // J
    std::vector<std::uint8_t> stalled_;
    std::vector<Island> islands_, seen_;  // in the world; relative to moving drivers, empty if there are none
};

}  // namespace rapid
