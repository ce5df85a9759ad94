// The coupled part of a sub-step, once each point has moved freely: all constraints, and the shapes that these push
// points into (constraint.h says in which order).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "runtime/solver/constraints/carried_impulses.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/energy_bound.h"
#include "runtime/solver/constraints/holding.h"
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
    // sleep: null where no point may sleep; the constraints join it. loads: of the frame before; null for none.
    Projection(std::span<const LocalConstraint> constraints, std::span<const Obstacle> obstacles, const Substep& step,
               Sleep* sleep, const ShapeLoads* loads, const PointErrors& errors);

    // Whether it has impacts to solve; Substep::paths are needed then.
    bool bounces() const;
    // Error: a point's P or v is not finite any more.
    void advance(Substep& step);
    Residual close(Substep& step, ShapeLoads* loads);

    // What has been added so far, by corrections of positions where no velocity paid for it (energy_bound.h) and by
    // what moves by itself; and what contacts, shapes and rows have taken after rods and springs.
    const ContactEnergy& energy() const { return energy_; }
    // J: by rods and springs; by all that follows them; by what pins move.
    const EnergyChanges& changes() const { return changes_; }
    // J, in rows, where points are now, or at these places.
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
    double energy_of_places(const Substep& step) const;
    void require_finite(const Substep& step) const;
    void begin_support(Substep& step);
    void follow_rods(const Substep& step);
    void solve_impacts(Substep& step);

    std::vector<LocalConstraint> constraints_;
    std::vector<Holding*> holdings_;          // of the constraints
    std::vector<CarriedImpulses*> carrying_;  // of the constraints
    Sleep* sleep_;
    const PointErrors& errors_;
    bool has_forces_;       // some constraint (Coupling::has_forces)
    bool may_gain_;         // some constraint does not only take energy, or springs draw points
    bool is_driven_;        // some constraint moves points by itself
    bool carries_ = false;  // shapes do, points that are glued to them
    bool follows_;          // or some point that no row moves has a velocity
    bool moving_support_;   // or a shape moves
    EnergyBound bound_;
    RigidFallback fallback_;
    ContactEnergy energy_;
    EnergyChanges changes_;
    std::optional<ShapeContacts> shapes_;
    std::vector<Vec3d> free_;                           // where the points' free motion has ended
    std::vector<Vec3d> linked_;                         // where the projection begins, if elsewhere
    std::vector<Vec3d> begun_;                          // where rows begin: with what pins move where they move it
    std::vector<double> stored_;                        // J, in rows, there
    std::vector<std::uint8_t> support_, next_support_;  // Substep::support
    std::vector<Vec3d> support_v_, next_support_v_;     // Substep::support_v
    std::vector<std::uint32_t> rods_;                   // by point, the island that rods and springs link it to
};

}  // namespace rapid
