// A step of Solve, and what observes it: finds something out about the step and changes none of its points.
//
// Solve prepares a step, lets the observers begin, advances the points, lets the observers end, ages the points and
// feeds them back. No observer is called by point or by sub-step. One that needs what happens within the step gives the
// solver a place to write it to (SolveOptions::met, taken and log) when it begins.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/graph/evaluation.h"
#include "runtime/graph/simulation.h"
#include "runtime/points/state_archive.h"
#include "runtime/solver/estimate/error_control.h"

namespace rapid {

struct Step {
    Flow flow;
    const Evaluation& now;
    const std::optional<double> tolerance;  // m a frame
    const int max_substeps;                 // with a tolerance
    SolveOptions options = {};
    Dynamics run = {}, finer = {};  // for the points; for shadows, with twice the sub-steps
    Tolerated done = {};            // after the advance

    // Findings of observers that later ones read.
    std::uint64_t beyond = 0;            // points that miss the tolerance, by a sample
    std::vector<std::int64_t> ids = {};  // of the points whose errors are known
    std::vector<double> errors = {};     // m, of those
    bool is_exact = false;               // all points are where their equations take them

    bool is_coupled() const { return !flow.dynamics.constraints().empty(); }
    // Whether neighbours act on each other at the ends of sub-steps.
    bool interacts() const { return !tolerance && !flow.dynamics.interactions().empty(); }
    // Whether no point's motion within the frame depends on another's.
    bool moves_alone() const { return !is_coupled() && !interacts(); }

    // With a tolerance, the points of the sample are checked in any case.
    bool estimates_errors() const { return flow.simulation->estimates_errors || tolerance; }
    double allowed_error() const;  // m, by the tolerance
    // Advances points by the step: with the sub-steps of the options, or with those that the tolerance needs. By twice
    // as fine steps the allowed error is a quarter.
    Tolerated advance(PointSet& points, const Dynamics& dynamics, const SolveOptions& with, int finer_by = 1) const;
    void note_errors(std::span<const std::int64_t> of, std::vector<double> found);
    void warn(const std::string& text) const;
};

class StepObserver {
public:
    virtual ~StepObserver() = default;

    // Whether it observes this step. Most leave out those of a trial, which moves no points.
    virtual bool observes(const Step& step) const { return !step.flow.simulation->trial; }

    // The initial state, before any dynamics.
    virtual void start(Flow&) {}
    // Before the points move. entered: the points before the kicks of interactions at the beginning of the step.
    virtual void begin(Step&, const PointSet& /*entered*/) {}
    // After they have moved. moved: the points before the kicks at the end of the step.
    virtual void end(Step&, const PointSet& /*moved*/) {}
    // The points whose mask is 0 have reached the end of their lives, and are about to be removed.
    virtual void bury(const Step&, std::span<const std::uint8_t> /*stays*/) {}
    // Adds attributes to the result of Solve that the state does not keep.
    virtual void annotate(PointSet&) {}

    // What the next steps depend on.
    virtual void save(StateWriter&) const {}
    virtual void load(StateReader&) {}
};

// All observers of a Solve. They are called, saved and loaded in one order.
class StepObservers {
public:
    StepObservers();

    // Forgets the steps so far.
    void start(Flow& flow);
    void begin(Step& step, const PointSet& entered);
    // Calls f of each observer of the step.
    template <class F>
    void each(const F& f)
    {
        for (StepObserver* observer : observing_) f(*observer);
    }

    template <class Archive>
    void serialize(Archive& keep)
    {
        for (const std::unique_ptr<StepObserver>& observer : all_)
            if constexpr (Archive::is_saving::value)
                observer->save(keep);
            else
                observer->load(keep);
    }

private:
    std::vector<std::unique_ptr<StepObserver>> all_;
    std::vector<StepObserver*> observing_;  // of all, those of the step
};

}  // namespace rapid
