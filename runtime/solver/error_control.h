// Sub-steps by what error is asked for.
//
// A point's result depends on no other point's, so each takes its own number: twice as many and twice again, until the
// last doubling has moved it by no more than the tolerance. That is at least the error of the finer of the two, which
// is the result, where halving the step halves the error; where that quarters it, three times it.
#pragma once

#include <span>

#include "runtime/solver/solve.h"

namespace rapid {

struct Tolerated {
    SolveResult result;
    int substeps = 1;          // the most that a point took
    std::uint64_t beyond = 0;  // points whose estimate is above the tolerance at max_substeps
};

// Solves with the sub-steps that each point needs by itself for an error of at most `tolerance` (m): a multiple of
// options.substeps by a power of 2, from twice as many on, up to max_substeps.
Tolerated solve_within(PointSet& points, std::span<const DynamicPtr> dynamics, const SolveOptions& options,
                       double tolerance, int max_substeps);

}  // namespace rapid
