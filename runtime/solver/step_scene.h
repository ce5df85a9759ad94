// The dynamics of a chain, resolved for one set of points and one step: uniform forces summed, parameters and groups
// looked up as columns.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/collision/obstacle.h"
#include "runtime/solver/collision_radii.h"
#include "runtime/solver/constraints/projection.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

// A force that varies between points, or acts only on a group.
struct StepForce {
    const Force* force;
    std::optional<Uniform> uniform;
    Strided<std::uint8_t> members;
    bool all;
};

struct StepAction {
    const Action* action;
    std::unique_ptr<ActionPass> pass;
};

struct StepScene {
    // Throws Error, with the node, for the first dynamic in the chain that does not fit the points.
    StepScene(PointSet& points, const Dynamics& dynamics, double h);

    std::vector<StepAction> actions;
    Uniform uniform;  // the sum of all uniform forces on all points
    std::vector<StepForce> forces;
    std::optional<CollisionRadii> radii;  // of the obstacles
    std::vector<Obstacle> obstacles;
    std::vector<LocalConstraint> constraints;
    bool kills = false, records = false;   // some collider kills, or records hits
    const Column<Vec3f>* force = nullptr;  // the column `force`; null if it is zero
    Strided<float> mass;                   // kg

    bool is_uniform() const { return forces.empty() && !force; }
    // Returns true if points far from shapes have a path in closed form for the whole frame.
    bool is_ballistic() const;
};

// Returns true if motion under a constant acceleration and these linear forces has a closed form for the whole frame.
inline bool has_closed_form(const Linear& linear) { return linear.w2 == 0 && linear.c == 0; }

// Returns the column `force`; null if it is missing or zero everywhere.
const Column<Vec3f>* nonzero_forces_of(const PointSet& points);

}  // namespace rapid
