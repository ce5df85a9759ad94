// The dynamics of a step in which some change: with forces at the middles of its sub-steps, and interactions at their
// ends, and constraints with places that are functions of time. Of other constraints and of colliders the run has those
// of the end of the step, shadows those of its middle.
#pragma once

#include <memory>

#include "runtime/solver/changing.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/solve.h"

namespace rapid {

class ChangingDynamics {
public:
    // Before colliders are set in motion.
    void note_colliders(const Dynamics& dynamics);
    // Call once a step, then, on the thread that evaluates nodes. most_substeps: that a point may take; 0: no
    // tolerance. estimates: the error is asked for, too. has_births: points have times of their own.
    void begin(const Dynamics& dynamics, const SolveOptions& options, int most_substeps, bool estimates,
               bool has_births);

    // Whether something changes in this step.
    bool any() const { return any_; }
    // For the run; and for shadows, with twice the sub-steps, whose difference holds the error of interpolation too.
    const Dynamics& run() const { return run_; }
    const Dynamics& finer() const { return finer_; }

private:
    Dynamics::List<ChangingCollider> colliders_;  // by their place; null where one does not change
    Dynamics run_, finer_;
    bool any_ = false;
};

}  // namespace rapid
