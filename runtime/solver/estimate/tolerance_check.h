// A second opinion on what solve_within() promises.
//
// Doubling compares runs of n, 2n, 4n, ... sub-steps. A force that all of them meet at the same phase, such as
// sin(2π 96 t) at 24 frames a second, or a jump that two of them miss, looks solved. A sample of the points is solved
// again from the same state with 3n, 6n, 12n, ... sub-steps, which share no moment but the ends, and a quarter of the
// tolerance; a point that comes out elsewhere by half the tolerance is beyond it, and counts for its share of all.
//
// In each of the first frames, then in every fourth: the part that was found last holds between.
#pragma once

#include "runtime/points/state_archive.h"
#include "runtime/points/state_checks.h"
#include "runtime/solver/estimate/error_control.h"

namespace rapid {

class ToleranceCheck {
public:
    // Returns how many of the points in `solved` are beyond the tolerance. sample: points before Solve, some of those.
    // The rest as given to solve_within().
    std::uint64_t beyond(const PointSet& sample, const PointSet& solved, const Dynamics& dynamics,
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
