// A step of points that do not depend on one another: each block goes through the whole frame while it is in cache.
//
// This exists alongside the coupled step, in which the substep is a barrier, because main memory is then read and
// written once per frame for any number of substeps. Points moved only by a uniform acceleration and linear drag take
// no substeps at all (motion/ballistic_batch.h).
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
    // refinement: takes the results, which are then not stored; null: one run, which is stored.
    UncoupledStep(StepContext& context, Refinement* refinement) : context_(context), refinement_(refinement) {}

    void run();

private:
    void advance_chunk(std::size_t begin, std::size_t end);
    BallisticBatch::Progress advance_ballistic(std::size_t begin, std::size_t end, std::vector<std::uint32_t>& near);
    void advance_by_substeps(std::span<const std::uint32_t> indices);

    StepContext& context_;
    Refinement* const refinement_;
};

}  // namespace rapid
