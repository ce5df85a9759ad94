// The ledger of coupled points: their energy and momentum at the end of a frame, and what has changed the energy in it.
#pragma once

#include <optional>

#include "runtime/math/vec.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// Residues beyond this part of what is in motion are no rounding.
constexpr double largest_residue = 1e-5;

// What changed the energy in a frame, J.
struct EnergyChanges {
    double rods = 0;      // and springs
    double contacts = 0;  // with shapes, too, and corrections of positions
    double pins = 0;      // what they move by themselves, and the rods and springs that they pull
    double drag = 0;
    // Of `contacts`, where contact forces are recorded and nothing turns: by friction; by shapes that move.
    struct Split {
        double friction = 0, shapes = 0;
    };
    std::optional<Split> split;

    double sum() const;
    EnergyChanges& operator+=(const EnergyChanges& other);
};

struct Ledger {
    // At the end of the frame, J: of motion; in the acceleration that is the same for all points; in compliant rows.
    double kinetic = 0, potential = 0, elastic = 0;
    EnergyChanges by;
    double by_motion = 0;  // all else: forces that vary, actions, points that were put out of shapes
    Vec3d momentum = Vec3d::Zero(), angular_momentum = Vec3d::Zero();  // kg m/s; kg m²/s about the origin
    // Where nothing acts on the points but that acceleration and each other: the parts of the energy, the momentum and
    // the angular momentum in motion that the frame has changed them by beside it. Friction without spin turns points.
    struct Residue {
        double energy = 0, momentum = 0, angular_momentum = 0;

        bool is_rounding() const { return energy <= largest_residue && momentum <= largest_residue; }
    };
    std::optional<Residue> residue;

    double energy() const { return kinetic + potential + elastic; }
    // Takes the next part of the frame.
    void append(const Ledger& later);
};

// What a ledger is made of, at one moment.
struct LedgerState {
    double mass = 0;
    double kinetic = 0, potential = 0, elastic = 0;
    Vec3d center = Vec3d::Zero();  // kg m
    Vec3d momentum = Vec3d::Zero(), angular_momentum = Vec3d::Zero();
    double speed = 0, turning = 0;  // Σ m |v|, kg m/s; Σ m |x - c| |v|, kg m²/s

    double energy() const { return kinetic + potential + elastic; }
    // Points of finite mass.
    static LedgerState of(const Substep& step, double elastic);
};

// Of a frame of h seconds. is_isolated: nothing acts but `a` and the points on each other.
Ledger ledger_of(const LedgerState& before, const LedgerState& after, const EnergyChanges& by, bool is_isolated,
                 const Vec3d& a, double h);

}  // namespace rapid
