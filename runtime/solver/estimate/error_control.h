// Sub-steps by what error is asked for.
//
// A point's result depends on no other point's, so each takes its own number: n, twice as many and twice again. What
// these runs tend to is better than the last of them: their errors are a series in powers of the step, and each further
// run takes one more of these out (Romberg 1955): the even powers where forces alone act, from the first on where
// actions do. (Drag beside forces of place has odd ones too, from the third on; they are then only made less.) That is
// the result, position and velocity, until the last power has moved it by no more than the tolerance: the error of what
// stood there before, so that the result is well within. By a velocity a point is moved in the next frame: it may be
// off by the tolerance a frame.
//
// A way that a shape has broken has no such series, and what would lie in a shape is not used either. Then the result
// is the last run itself; how far that is from the run before is at least its error where halving the step halves it,
// and three times it where that quarters it. A way in closed form is solved once.
//
// Layout: a block of points takes its runs while it is in cache, as long as most of it needs them; those that need more
// are gathered from all blocks as a set of their own.
#pragma once

#include <span>

#include "runtime/solver/solve.h"

namespace rapid {

struct Tolerated {
    SolveResult result;
    int substeps = 1;          // the most that a point took in one run
    std::uint64_t beyond = 0;  // points whose estimate is above the tolerance at max_substeps
};

// Solves with the sub-steps that each point needs by itself for an error of at most `tolerance` (m): a multiple of
// options.substeps by a power of 2, up to max_substeps.
Tolerated solve_within(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, double tolerance,
                       int max_substeps);

}  // namespace rapid
