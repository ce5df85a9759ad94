#include "runtime/solver/collision_radii.h"

#include <algorithm>

#include "runtime/points/members.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

CollisionRadii::CollisionRadii(const Dynamics& dynamics, const PointSet& points) : points_(&points)
{
    const bool requested = std::any_of(dynamics.colliders().begin(), dynamics.colliders().end(),
                                       [](const auto& collider) { return !collider->radius; });
    for (const auto& constraint : dynamics.constraints()) {
        const std::optional<PerPoint<float>> given = constraint->radius();
        if (!requested || !given) continue;
        at_node(*constraint, [&] {
            const Strided<float> radius = given->read(points);
            const Strided<std::uint8_t> members = members_of(points, constraint->group);
            by_constraint_.resize(points.size());
            for (std::size_t i = 0; i < points.size(); ++i)
                if (members[i]) by_constraint_[i] = std::max(by_constraint_[i], radius[i]);
        });
    }
    if (by_constraint_.empty() || !points.has("pscale")) return;
    const Strided<float> pscale = points.column<float>("pscale").read();
    for (std::size_t i = 0; i < points.size(); ++i)
        if (pscale[i] > 0) by_constraint_[i] = pscale[i];
}

Strided<float> CollisionRadii::of(const Collider& collider) const
{
    if (!collider.radius && !by_constraint_.empty()) return {by_constraint_.data(), 1};
    return radii_of(collider.radius, *points_);
}

}  // namespace rapid
