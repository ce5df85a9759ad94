// Adaptive substeps: each point takes as many as a given tolerance requires.
//
// No point depends on another, so each takes an individual number of substeps: n, 2n, 4n, ... The runs are
// extrapolated to a step of zero (step_doubling.h). The extrapolation, in position and velocity, is the result as soon
// as the last power of the step changes it by at most the tolerance. That estimates the error before this correction,
// so the result is well within the tolerance. A velocity error displaces the point in the next frame: it may be as
// large as the tolerance per frame. (With drag and position-dependent forces there are odd powers from the third on,
// which the extrapolation reduces but does not eliminate.)
//
// A path with a contact cannot be extrapolated, and an extrapolation inside a shape is not used. The result is then
// the last run itself. Its difference from the previous run is at least its error if halving the step halves the
// error, or three times the error if it quarters it. A path in closed form is solved once.
//
// Layout: a block of points takes its runs while it is in cache, as long as most of its points need them. The
// remaining points of all blocks are gathered into a separate set.
#pragma once

#include <span>

#include "runtime/solver/solve.h"

namespace rapid {

// Solves with the substeps that each point needs for an error of at most `tolerance` (m): options.substeps times a
// power of 2, up to max_substeps. Of the figures, `substeps` is the largest number in a run of any point, and
// `beyond_tolerance` counts the points that miss the tolerance at max_substeps.
FrameFigures solve_within(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, double tolerance,
                          int max_substeps);

}  // namespace rapid
