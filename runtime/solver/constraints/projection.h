// The coupled part of a substep, after each point has moved freely: all constraints, and the shapes that these push
// points into (constraint.h gives the order).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/energy_bound.h"
#include "runtime/solver/constraints/pair_impulses.h"
#include "runtime/solver/constraints/shape_contacts.h"
#include "runtime/solver/ledger.h"
#include "runtime/solver/point_errors.h"

namespace rapid {

// A constraint with its rows.
struct LocalConstraint {
    const Constraint* constraint;
    std::shared_ptr<Coupling> coupling;
};

class Projection {
public:
    // sleep: null if no point may sleep; the constraints join it. loads: from the previous frame; null for none.
    Projection(std::span<const LocalConstraint> constraints, std::span<const Obstacle> obstacles, const Substep& step,
               Sleep* sleep, const ShapeLoads* loads, const PointErrors& errors);

    // Returns true if it has impacts to solve, which need Substep::paths.
    bool bounces() const;
    // Throws Error if a point's P or v is no longer finite.
    void advance(Substep& step);
    void close(Substep& step, ShapeLoads* loads, FrameFigures& figures);

    // The energy added so far, by position corrections that no velocity paid for (energy_bound.h) and by drivers; and
    // the energy that contacts, shapes and rows took after rods and springs.
    const ContactEnergy& energy() const { return energy_; }
    // J: changes by rods and springs, by the steps after these, and by pins.
    const EnergyChanges& changes() const { return changes_; }
    // Returns the energy in rows, J, at the current positions or at these.
    double elastic_energy(const Substep& step, std::span<const Vec3d> at = {}) const;
    bool keeps_momentum() const;

private:
    template <class F>
    void each(const F& f);
    double work_of_displacements(const Substep& step) const;
    double stored_change(const Substep& step, std::span<const Vec3d> from, std::span<const Vec3d> to) const;
    void advance_linked(Substep& step, double carrying);
    void add_stored(const Substep& step, std::span<const Vec3d> at, double factor, std::span<double> energy) const;
    double driven_energy(const Substep& step) const;
    double credited();
    void begin_rows(const Substep& step);
    double work_of_carrying(const Substep& step) const;
    void move_kinematic(Substep& step);
    void store_in_frame(const Substep& step);
    ContactEnergy close_bound(Substep& step, bool of_rods);
    void link(EnergyIslands& islands, const Substep& step, bool of_rods) const;
    double energy_of_positions(const Substep& step) const;
    void require_finite(const Substep& step) const;
    void begin_support(Substep& step);
    std::vector<float> sizes() const;
    void follow_rods(const Substep& step);
    void solve_impacts(Substep& step);

    std::vector<LocalConstraint> constraints_;
    std::vector<Holding*> holdings_;          // those of constraints_ that implement it
    std::vector<CarriedImpulses*> carrying_;  // those of constraints_ that implement it
    Sleep* sleep_;
    const PointErrors& errors_;
    bool has_forces_;       // some constraint (Coupling::has_forces)
    bool may_gain_;         // some constraint may add energy, or springs draw points
    bool is_driven_;        // some constraint moves points by itself
    bool carries_ = false;  // shapes carry points that are glued to them
    bool follows_;          // or some point that no row moves has a velocity
    bool moving_support_;   // or a shape moves
    EnergyBound bound_;
    RigidFallback fallback_;
    ContactEnergy energy_;
    EnergyChanges changes_;
    std::optional<ShapeContacts> shapes_;
    std::vector<Vec3d> free_;                           // positions after the points' free motion
    std::vector<Vec3d> linked_;                         // positions at the start of the projection, if different
    std::vector<Vec3d> begun_;                          // positions at the start of rows, after kinematic motion
    std::vector<double> stored_;                        // J, in rows, at begun_
    std::vector<std::uint8_t> support_, next_support_;  // Substep::support
    std::vector<Vec3d> support_v_, next_support_v_;     // Substep::support_v
    std::vector<std::uint32_t> rods_;                   // by point: its island of rods and springs
    std::vector<ContactPair> joined_;                   // sorted: pairs that do not collide
};

}  // namespace rapid
