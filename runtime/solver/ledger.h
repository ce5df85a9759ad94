// The ledger of coupled points: their energy and momentum at the end of a frame, and the changes of the energy in it.
#pragma once

#include <optional>

#include "runtime/math/vec.h"

namespace rapid {

struct Substep;

// A residue above this fraction of the energy or momentum in motion is not rounding.
constexpr double largest_residue = 1e-5;

// Contributions to the change of energy in a frame, J.
struct EnergyChanges {
    double rods = 0;      // including springs
    double contacts = 0;  // including shapes and position corrections
    double pins = 0;      // by their own motion, and the rods and springs that they pull
    double drag = 0;
    // Parts of `contacts` if contact forces are recorded and nothing turns: by friction, and by moving shapes.
    struct Split {
        double friction = 0, shapes = 0;
    };
    std::optional<Split> split;

    double sum() const;
    EnergyChanges& operator+=(const EnergyChanges& other);
};

struct Ledger {
    // At the end of the frame, J: kinetic; potential in the common acceleration; elastic in compliant rows.
    double kinetic = 0, potential = 0, elastic = 0;
    EnergyChanges by;
    double by_motion = 0;  // everything else: varying forces, actions, points moved out of shapes
    Vec3d momentum = Vec3d::Zero(), angular_momentum = Vec3d::Zero();  // kg m/s; kg m²/s about the origin
    // Set if only the common acceleration and the points themselves act: the relative change of energy, momentum and
    // angular momentum in the frame beyond that acceleration's. Friction without spin changes angular momentum.
    struct Residue {
        double energy = 0, momentum = 0, angular_momentum = 0;

        bool is_rounding() const { return energy <= largest_residue && momentum <= largest_residue; }
    };
    std::optional<Residue> residue;

    // Appends the next part of the frame.
    void append(const Ledger& later);
};

// The quantities for a ledger at one time.
struct LedgerState {
    double mass = 0;
    double kinetic = 0, potential = 0, elastic = 0;
    Vec3d center = Vec3d::Zero();  // kg m
    Vec3d momentum = Vec3d::Zero(), angular_momentum = Vec3d::Zero();
    double speed = 0, turning = 0;  // Σ m |v|, kg m/s; Σ m |x - c| |v|, kg m²/s

    double energy() const { return kinetic + potential + elastic; }
    // Sums over points of finite mass.
    static LedgerState of(const Substep& step, double elastic);
};

// Returns the ledger of a frame of h seconds. is_isolated: only `a` and the points themselves act.
Ledger ledger_of(const LedgerState& before, const LedgerState& after, const EnergyChanges& by, bool is_isolated,
                 const Vec3d& a, double h);

}  // namespace rapid
