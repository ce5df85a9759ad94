// Adaptive substeps: each point takes as many as a given tolerance requires.
//
// No point depends on another, so each takes an individual number of substeps: n, 2n, 4n, ... The runs are
// extrapolated to a step of zero. The extrapolation, in position and velocity, is the result as soon
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

#include "runtime/points/state_archive.h"
#include "runtime/solver/solve.h"

namespace rapid {

// Solves with the substeps that each point needs for an error of at most `tolerance` (m): options.substeps times a
// power of 2, up to max_substeps. Of the figures, `substeps` is the largest number in a run of any point, and
// `beyond_tolerance` counts the points that miss the tolerance at max_substeps.
FrameFigures solve_within(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, double tolerance,
                          int max_substeps);

// An independent check of the results of solve_within().
//
// Doubling compares runs of n, 2n, 4n, ... substeps. A force that all of them meet at the same phase, such as sin(2π
// 96 t) at 24 frames a second, or a jump that two of them miss, looks solved. A sample of the points is solved again
// from the same state with 3n, 6n, 12n, ... substeps, which share only the ends, and a quarter of the tolerance. A
// point whose result differs by half the tolerance is beyond it, and counts for its share of all points.
//
// Runs in each of the first frames, then in every fourth; the last fraction found is used in between.
class ToleranceCheck {
public:
    // Returns the number of points in `solved` that are beyond the tolerance. sample: some of the points before Solve.
    // The other arguments are those of solve_within().
    std::uint64_t beyond_tolerance(const PointSet& sample, const PointSet& solved, const Dynamics& dynamics,
                                   const SolveOptions& options, double tolerance, int max_substeps);

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(frames_, part_);
        if constexpr (Archive::is_loading::value) StateReader::expect(frames_ >= 0 && is_between(part_, 0, 1));
    }

private:
    int frames_ = 0;
    double part_ = 0;
};

}  // namespace rapid
