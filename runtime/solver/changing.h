// Dynamics that change within a step, from a node with parameters that are functions of the frame.
//
// The node adds its state at the end of the step to the chain. `at` provides it at other times, which Solve chooses
// (operators/solve/step_dynamics.h). Called on the thread that evaluates nodes.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/interaction.h"

namespace rapid {

// Returns the dynamic at a part of the step, from 0 to 1. finer: uses a better interpolation, so that the difference
// estimates the error.
template <class D>
using AtPart = std::function<std::shared_ptr<const D>(double part, bool finer)>;

class ChangingForce : public Force {
public:
    ChangingForce(std::shared_ptr<const Force> end, AtPart<Force> at_part)
        : Force(*end), at(std::move(at_part)), end_(std::move(end))
    {
    }

    void contribute(const Chunk& chunk, Forces& forces) const override { end_->contribute(chunk, forces); }
    std::optional<Uniform> uniform() const override { return end_->uniform(); }
    bool add_potential(const Chunk& chunk, std::span<double> energy) const override
    {
        return end_->add_potential(chunk, energy);
    }

    const AtPart<Force> at;

private:
    std::shared_ptr<const Force> end_;
};

class ChangingInteraction : public Interaction {
public:
    ChangingInteraction(const Interaction& end, AtPart<Interaction> given) : Interaction(end), at_part(std::move(given))
    {
    }

    const AtPart<Interaction> at_part;
};

// Runs use the next two classes in their state at the end of the step, shadows in that at its middle.
class ChangingConstraint : public Constraint {
public:
    ChangingConstraint(std::shared_ptr<const Constraint> end, AtPart<Constraint> at_part)
        : Constraint(*end), at(std::move(at_part)), end_(std::move(end))
    {
    }

    std::shared_ptr<Coupling> begin(const PointSet& points, double frame_length) const override
    {
        return end_->begin(points, frame_length);
    }
    std::optional<PerPoint<float>> radius() const override { return end_->radius(); }
    double needed_substeps(const PointSet& points, const Vec3d& acceleration, double h) const override
    {
        return end_->needed_substeps(points, acceleration, h);
    }
    bool births_overlap() const override { return end_->births_overlap(); }
    std::shared_ptr<const Constraint> twin(const Constraint* before) const override { return end_->twin(before); }

    const AtPart<Constraint> at;

private:
    std::shared_ptr<const Constraint> end_;
};

class ChangingCollider : public Collider {
public:
    ChangingCollider(const Collider& end, AtPart<Collider> given) : Collider(end), at(std::move(given)) {}

    const AtPart<Collider> at;
};

}  // namespace rapid
