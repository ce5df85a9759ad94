// A sub-step of points that are coupled, once each has gone its own way: all constraints, and the shapes that those
// push points into (constraint.h says in which order, and why).
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
    Projection(std::span<const LocalConstraint> constraints, std::span<const Obstacle> obstacles, std::size_t size);

    // loads: of the frame before; null for none.
    void open(const Substep& now, const ShapeLoads* loads, const Column<std::int64_t>& ids);
    void advance(Substep& now);
    Residual close(Substep& now, ShapeLoads* loads, const Column<std::int64_t>& ids);

private:
    template <class F>
    void each(const F& f);

    std::span<const LocalConstraint> constraints_;
    std::optional<ShapeContacts> shapes_;
    void find_borne(Substep& now);

    std::vector<Vec3d> free_;                        // where the points' own ways have ended
    std::vector<std::uint8_t> borne_, found_borne_;  // Substep::borne
};

}  // namespace rapid
