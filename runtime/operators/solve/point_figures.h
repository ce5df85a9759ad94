// What Solve can tell of single points, as attributes of its result, for those who look at them
// (Evaluator::tell_points):
//
//   error     m, the estimated error of the position; nan where the point is not in the sample
//   substeps  that the frame took of the point
//   asleep    1 of those that sleep, else 0
//
// The state does not keep them. A scene's own attribute of one of these names stays.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/solve.h"

namespace rapid {

class PointFigures {
public:
    // Before Solve. has_tolerance: points take sub-steps of their own, for which the options ask from now on.
    void begin(const PointSet& points, SolveOptions& options, bool has_tolerance);
    // ids: ascending; errors: m, of those points.
    void note_errors(std::span<const std::int64_t> ids, std::span<const double> errors);
    // All points are where their equations take them.
    void note_no_errors() { are_exact_ = true; }
    void note_asleep(std::int64_t id) { asleep_.push_back(id); }
    // Gives the points the attributes. Without begin(): of the initial state, which nothing has moved yet.
    void put(PointSet& points) const;

private:
    bool are_exact_ = true;
    std::int32_t substeps_ = 0;
    Column<std::int64_t> ids_;                  // before Solve
    std::vector<std::int32_t> taken_;           // in their order; empty where all take substeps_
    std::vector<std::int64_t> known_, asleep_;  // ids
    std::vector<float> errors_;                 // of those known
};

}  // namespace rapid
