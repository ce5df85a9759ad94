// The coupled part of a sub-step, once each point has moved freely: all constraints, and the shapes that these push
// points into (constraint.h says in which order).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/shape_contacts.h"

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
               Sleep* sleep, const ShapeLoads* loads, const Column<std::int64_t>& ids);

    // Whether it has impacts to solve; Substep::paths are needed then.
    bool bounces() const;
    void advance(Substep& step);
    Residual close(Substep& step, ShapeLoads* loads, const Column<std::int64_t>& ids);

private:
    template <class F>
    void each(const F& f);
    void begin_support(Substep& step);
    void solve_impacts(Substep& step);

    std::span<const LocalConstraint> constraints_;
    Sleep* sleep_;
    bool has_forces_;  // some constraint (Coupling::has_forces)
    std::optional<ShapeContacts> shapes_;
    std::vector<Vec3d> free_;                           // where the points' free motion has ended
    std::vector<Vec3d> linked_;                         // where the projection begins, if elsewhere
    std::vector<std::uint8_t> support_, next_support_;  // Substep::support
};

}  // namespace rapid
