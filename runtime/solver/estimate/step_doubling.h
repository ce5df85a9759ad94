// Step doubling: runs of points through a frame with n, 2n, 4n, ... sub-steps, until each point's result is good enough
// (error_control.h). The runs of a block are taken while it is in cache.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "runtime/solver/estimate/extrapolation.h"
#include "runtime/solver/refinement.h"

namespace rapid {

// When a run may be a point's result, and when it is the last one.
struct StepDoublingLimits {
    double tolerance;    // m
    int first_substeps;  // of a point's first run
    int max_substeps;
    double h;             // s, frame length
    std::uint8_t* met;    // set to 1 for points that meet a shape, by index in the set; may be null
    std::int32_t* taken;  // set to the sub-steps of a point's result, likewise
    bool repeats;         // a block may run through the frame more than once

    bool is_first(int substeps) const { return substeps == first_substeps; }
    // One run has no estimate, so that there is a second even beyond max_substeps, but only for the error.
    bool may_be_result(int substeps) const { return is_first(substeps) || substeps <= max_substeps; }
    // Whether it is the result of points that still miss the tolerance.
    bool is_result_of_all(int substeps) const { return may_be_result(substeps) && substeps > max_substeps / 2; }
    bool is_last(int substeps) const { return !is_first(substeps) && substeps > max_substeps / 2; }
};

// Points that need further runs, all with the same number of runs so far.
struct UnfinishedPoints {
    std::vector<std::uint32_t> indices;  // in the set
    Extrapolation extrapolation;

    void append(const UnfinishedPoints& other);
};

// One traversal of a set, or of its unfinished points.
class StepDoubling final : public Refinement {
public:
    // substeps: of the next run. P and v: of all points, for the results. unfinished: the points that are solved, as a
    // set of their own; null: all points, from their first run on.
    StepDoubling(const StepDoublingLimits& limits, int substeps, std::span<Vec3f> P, std::span<Vec3f> v,
                 const UnfinishedPoints* unfinished);

    bool takes_exact() const override { return limits_.is_first(substeps_); }
    std::unique_ptr<BlockRefinement> begin() override;

    // Afterwards: the points that need further runs, by the sub-steps of the next one; those that have died.
    std::map<int, UnfinishedPoints> unfinished();
    std::span<const std::uint32_t> dead() const { return dead_; }

    int most_substeps() const { return most_substeps_; }
    std::uint64_t beyond() const { return beyond_; }  // points that miss the tolerance at max_substeps

private:
    class Block;

    std::uint32_t index_in_set(std::uint32_t solved) const { return from_ ? from_->indices[solved] : solved; }

    const StepDoublingLimits& limits_;
    const int substeps_;
    const std::span<Vec3f> P_, v_;
    const UnfinishedPoints* const from_;

    std::mutex mutex_;
    std::vector<std::pair<int, UnfinishedPoints>> unfinished_;
    std::vector<std::uint32_t> dead_;
    int most_substeps_ = 0;
    std::uint64_t beyond_ = 0;
};

}  // namespace rapid
