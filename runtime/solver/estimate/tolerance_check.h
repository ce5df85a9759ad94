// An independent check of the results of solve_within().
//
// Doubling compares runs of n, 2n, 4n, ... substeps. A force that all of them meet at the same phase, such as sin(2π
// 96 t) at 24 frames a second, or a jump that two of them miss, looks solved. A sample of the points is solved again
// from the same state with 3n, 6n, 12n, ... substeps, which share only the ends, and a quarter of the tolerance. A
// point whose result differs by half the tolerance is beyond it, and counts for its share of all points.
//
// Runs in each of the first frames, then in every fourth; the last fraction found is used in between.
#pragma once

#include "runtime/points/state_archive.h"
#include "runtime/points/state_checks.h"
#include "runtime/solver/estimate/error_control.h"

namespace rapid {

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
