// The radii at which points collide with shapes, m: those of the collider; otherwise the attribute pscale; if that is
// 0 or missing, the radius from a constraint. Points that keep each other at a distance thus have the same size for
// shapes.
#pragma once

#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

class CollisionRadii {
public:
    // Throws Error, with the node, if a constraint's attribute is missing.
    CollisionRadii(const Dynamics& dynamics, const PointSet& points);

    // Valid while this object, the collider and the points' columns exist.
    Strided<float> of(const Collider& collider) const;

private:
    const PointSet* points_;
    std::vector<float> by_constraint_;  // pscale, or from constraints; empty if these give nothing
};

}  // namespace rapid
