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

// A force that varies from point to point, or acts on a group only.
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
    // Error: of the first dynamic in the chain that does not fit the points, with its node.
    StepScene(PointSet& points, const Dynamics& dynamics, double h);

    std::vector<StepAction> actions;
    Uniform uniform;  // the sum of all uniform forces on all points
    std::vector<StepForce> forces;
    std::optional<CollisionRadii> radii;  // of the obstacles
    std::vector<Obstacle> obstacles;
    std::vector<LocalConstraint> constraints;
    bool kills = false, records = false;   // whether a collider does
    const Column<Vec3f>* force = nullptr;  // the column `force`; null where it is zero
    Strided<float> mass;                   // kg

    bool is_uniform() const { return forces.empty() && !force; }
    // Whether points far from shapes have a path in closed form for the whole frame.
    bool is_ballistic() const;
};

// Whether the motion under a constant acceleration and this has a closed form for the whole frame.
inline bool has_closed_form(const Linear& linear) { return linear.w2 == 0 && linear.c == 0; }

// The column `force`; null where there is none, or it is zero everywhere.
const Column<Vec3f>* nonzero_forces_of(const PointSet& points);

}  // namespace rapid
