// How wrong a frame's positions are, and sub-steps by what is asked for.
//
// A point's result depends on no other point's, so a few of them can be solved again, with finer steps, beside the
// rest. The estimate is twice the difference between n and 2 n sub-steps: at least the error of n where halving the
// step halves it, 1.5 times it where that quarters it. It is local: both begin from the same state. A path that bounces
// differently at the finer step is counted with all of its difference.
#pragma once

#include <span>
#include <vector>

#include "runtime/solver/solve.h"

namespace rapid {

// Points that are looked at in each frame: all, or this many, spread evenly over the set.
constexpr std::size_t error_sample = 1000;

// Those points, as they are before a step.
PointSet sample_of(const PointSet& points);

// The estimated errors of the positions of `sample` in this step, m, in order; shape [sample.size()] but for points
// that die in one of the two only.
std::vector<double> estimate_errors(const PointSet& sample, std::span<const DynamicPtr> dynamics,
                                    const SolveOptions& options);

struct Tolerated {
    SolveResult result;
    int substeps = 1;            // the most that a point took
    std::uint64_t beyond = 0;    // points whose estimate is above the tolerance at max_substeps
    std::vector<double> errors;  // estimated, m, of all points that live on
};

// Solves with the sub-steps that each point needs by itself for an estimated error of at most `tolerance` (m):
// options.substeps, and twice as many, up to max_substeps.
Tolerated solve_within(PointSet& points, std::span<const DynamicPtr> dynamics, const SolveOptions& options,
                       double tolerance, int max_substeps);

}  // namespace rapid
