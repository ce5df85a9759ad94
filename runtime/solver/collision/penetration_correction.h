// The final penetration correction, and the penetration that remains.
//
// Parts of a body that meet, or two bodies, leave no space for a point between them. At the end of the frame the point
// is moved out of both and keeps its velocity: along the shortest way or, if that only leads from one side of a closed
// gap to the other, to the nearest free position.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/collision/contact_audit.h"
#include "runtime/solver/collision/distance_query.h"
#include "runtime/solver/collision/ejection.h"
#include "runtime/solver/collision/touched_points.h"

namespace rapid {

class PenetrationCorrection {
public:
    PenetrationCorrection(const CollisionBlock& block, const TouchedPoints& touched, ContactAudit& audit)
        : block_(block), touched_(touched), audit_(audit)
    {
    }

    // P: at the end of the frame. lost: points that found no way out of a shape in their substeps.
    void run(std::span<Vec3d> P, const std::vector<std::uint32_t>& lost);
    // The displacements, in order.
    std::span<const Ejection::Displacement> displacements() const { return displacements_; }

    // Returns the largest penetration of a touched point, m, given the rounded positions.
    double deepest(std::span<const Vec3f> P);

private:
    void move_out(const Obstacle& obstacle, std::span<Vec3d> P, bool to_free_position);

    const CollisionBlock& block_;
    const TouchedPoints& touched_;
    ContactAudit& audit_;
    std::vector<std::uint32_t> inside_, still_inside_;
    std::vector<Ejection::Displacement> displacements_;
    DistanceQuery query_;
};

}  // namespace rapid
