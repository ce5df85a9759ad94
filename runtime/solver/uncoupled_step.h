// A step of points that do not depend on one another: each block goes through the whole frame while it is in cache.
//
// Why beside the coupled step, where the sub-step is a barrier: main memory is read and written once a frame, whatever
// the number of sub-steps; and points that nothing but a uniform acceleration and linear drag moves take no sub-steps
// at all (motion/ballistic_batch.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solver/block_step.h"
#include "runtime/solver/refinement.h"
#include "runtime/solver/step_context.h"

namespace rapid {

class UncoupledStep {
public:
    // refinement: takes the results, which then are not stored; null: one run, which is stored.
    UncoupledStep(StepContext& context, Refinement* refinement) : context_(context), refinement_(refinement) {}

    void run();

private:
    void advance_chunk(std::size_t begin, std::size_t end);
    BallisticBatch::Progress advance_ballistic(std::size_t begin, std::size_t end, std::vector<std::uint32_t>& near);
    void advance_by_substeps(std::span<const std::uint32_t> places);

    StepContext& context_;
    Refinement* const refinement_;
};

}  // namespace rapid
