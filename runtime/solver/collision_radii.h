// The radii at which points meet shapes, m: those of the collider; else the attribute pscale; where that is 0 or
// missing, the radius that a constraint gives the point. Points that keep each other at a distance are as large for
// shapes.
#pragma once

#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

class CollisionRadii {
public:
    // Error: a constraint's attribute is missing, with its node.
    CollisionRadii(const Dynamics& dynamics, const PointSet& points);

    // Valid while this, the collider and the points' columns stay.
    Strided<float> of(const Collider& collider) const;

private:
    const PointSet* points_;
    std::vector<float> by_constraint_;  // pscale, or what constraints give; empty where these give nothing
};

}  // namespace rapid
