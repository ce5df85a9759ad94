// Dynamics that change within a step, from a node with parameters that are functions of the frame.
//
// The node adds its state at the end of the step to the chain. `at` provides it at other times, which Solve chooses
// (operators/solve/step_dynamics.h). Called on the thread that evaluates nodes.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
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

// The type of a parameter that gives positions, which are interpolated if it is a function of the frame.
constexpr std::string_view place_type = "vec3, attribute or moving shape";

// An interface of a Constraint whose node has such a parameter.
class Placed {
public:
    virtual ~Placed() = default;

    // Parts of the step at which positions are given.
    static constexpr std::array<double, 4> parts = {0, 1.0 / 3, 2.0 / 3, 1};
    using AtParts = std::array<std::shared_ptr<const Constraint>, parts.size()>;

    // Returns the constraint in its state at the end of the step, with positions on the cubic through those at
    // `parts`. Returns null if these are not numbers.
    virtual std::shared_ptr<const Constraint> through(const AtParts& at) const = 0;
};

// A force that changes within the step, given at evenly spaced times. Each substep uses the one nearest to its middle.
class TimedForce : public Force {
public:
    // forces: at k h / (n - 1) after `begin` (s), k = 0 ... n - 1. less: an acceleration that is applied separately,
    // m/s².
    TimedForce(std::vector<std::shared_ptr<const Force>> forces, double begin, double h, const Vec3d& less);

    void contribute(const Chunk& chunk, Forces& forces) const override;
    bool add_potential(const Chunk&, std::span<double>) const override { return false; }

    // Returns the whole force at a time, s; nothing if it differs between points.
    std::optional<Uniform> uniform_at(double time) const;

private:
    std::size_t nearest(double time) const;
    void contribute(std::size_t k, const Chunk& chunk, Forces& forces) const;

    std::vector<std::shared_ptr<const Force>> forces_;
    double begin_, h_;  // s
    Vec3d less_;
};

}  // namespace rapid
