// The ledger of coupled points: their energy and momentum at the end of a frame, and what has changed the energy in it.
#pragma once

#include <optional>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/vec.h"

namespace rapid {

// Residues beyond this part of what is in motion are no rounding.
constexpr double largest_residue = 1e-5;

struct Ledger {
    // At the end of the frame, J: of motion; in the acceleration that is the same for all points; in compliant rows.
    double kinetic = 0, potential = 0, elastic = 0;
    // In the frame, J: by rods and springs; by contacts, what they push into shapes, and corrections of positions; by
    // all else: forces that vary, drag, shapes met in free motion, what moves by itself.
    double by_rods = 0, by_contacts = 0, by_motion = 0;
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
Ledger ledger_of(const LedgerState& before, const LedgerState& after, double by_rods, double by_contacts,
                 bool is_isolated, const Vec3d& a, double h);

}  // namespace rapid
