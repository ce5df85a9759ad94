// A step of Solve, and its observers, which analyse the step and change none of its points.
//
// Solve prepares a step, lets the observers begin, advances the points, lets the observers end, ages the points and
// feeds them back. No observer is called per point or per substep. An observer that needs events within the step gives
// the solver a place to write them (SolveOptions::sinks) when it begins.
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

// The largest number of substeps of a step.
constexpr int substep_limit = 1 << 20;

struct Step {
    Flow flow;
    const Evaluation& now;
    const std::optional<double> tolerance;  // m per frame
    const int max_substeps;                 // with a tolerance or without substeps
    int needed = 0;                         // needed_substeps() before the step; 0 if unknown
    SolveOptions options = {};
    Dynamics run = {}, finer = {};  // for the points; for shadows, with twice the substeps
    FrameFigures done = {};         // after the advance

    // Findings of observers that later ones read.
    std::uint64_t beyond_tolerance = 0;  // points that miss the tolerance, from a sample
    std::vector<std::int64_t> ids = {};  // of the points whose errors are known
    std::vector<double> errors = {};     // m, by ids
    bool is_exact = false;               // all points are exactly on their trajectories

    bool is_coupled() const { return !flow.dynamics.constraints().empty(); }
    // Returns true if neighbours act on each other at the ends of substeps.
    bool interacts() const { return !tolerance && !flow.dynamics.interactions().empty(); }
    // Returns true if no point's motion within the frame depends on another's.
    bool moves_alone() const { return !is_coupled() && !interacts(); }

    // Returns the number of substeps that the constraints need for the points as they are now.
    int needed_substeps(int iterations) const;
    // Returns true in steps 1, 2, 4, 8, ... Points change as they move, and to examine these steps alone costs little.
    bool is_examined() const;

    // The sample is always checked if there is a tolerance.
    bool estimates_errors() const { return flow.simulation->estimates_errors || tolerance; }
    double allowed_error() const;  // m, from the tolerance
    // Advances points by the step: with the substeps of the options, or with those that the tolerance needs. With
    // twice as fine steps, the allowed error is a quarter.
    FrameFigures advance(PointSet& points, const Dynamics& dynamics, const SolveOptions& with, int finer_by = 1) const;
    void note_errors(std::span<const std::int64_t> of, std::vector<double> found);
    void warn(const std::string& text) const;
};

class StepObserver {
public:
    virtual ~StepObserver() = default;

    // Returns true if it observes this step. Most skip the steps of a trial, which moves no points.
    virtual bool observes(const Step& step) const { return !step.flow.simulation->trial; }

    // Handles the initial state, before any dynamics.
    virtual void start(Flow&) {}
    // Is called before the points move. entered: the points before the kicks of interactions at the beginning of the
    // step.
    virtual void begin(Step&, const PointSet& /*entered*/) {}
    // Is called after they have moved. moved: the points before the kicks at the end of the step.
    virtual void end(Step&, const PointSet& /*moved*/) {}
    // Is called when points with mask 0 have reached the end of their lives, before they are removed.
    virtual void before_removal(const Step&, std::span<const std::uint8_t> /*stays*/) {}
    // Adds attributes to the result of Solve that are not part of the state.
    virtual void annotate(PointSet&) {}

    // Save and load the state that later steps depend on.
    virtual void save(StateWriter&) const {}
    virtual void load(StateReader&) {}
};

// All observers of a Solve. They are called, saved and loaded in the same order.
class StepObservers {
public:
    StepObservers();

    // Resets all observers.
    void start(Flow& flow);
    void begin(Step& step, const PointSet& entered);
    // Calls f for each observer of the step.
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
    std::vector<StepObserver*> observing_;  // those of all_ that observe the step
};

}  // namespace rapid
