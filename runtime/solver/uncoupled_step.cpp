#include "runtime/solver/uncoupled_step.h"

#include <algorithm>
#include <numeric>

namespace rapid {
namespace {

// Takes blocks of one chunk through the frame.
class BlockRun {
public:
    explicit BlockRun(StepContext& context) : context_(context), step_(context) {}

    // Returns the largest penetration of a point at the end, m.
    double advance(Collisions& collisions, std::span<const std::uint32_t> indices, int substeps);
    void store() const { step_.store(); }
    BlockResult result(const Collisions& collisions);

private:
    void restore_others();

    StepContext& context_;
    BlockStep step_;
    std::vector<PathKind> paths_;
    std::vector<double> position_errors_;  // m
    std::vector<std::uint8_t> dead_;
};

double BlockRun::advance(Collisions& collisions, std::span<const std::uint32_t> indices, int substeps)
{
    const bool collides = !context_.scene.obstacles.empty();
    PointBlock& block = step_.block;
    step_.begin(indices, substeps);
    if (collides) collisions.begin(block.indices);
    for (int substep = 0; substep < substeps; ++substep) step_.advance(collisions, substep);
    if (!context_.advances_all()) restore_others();
    double deepest = 0;
    if (collides)
        deepest = collisions.round(block.P, block.rounded);
    else
        cast(std::span<const Vec3d>(block.P), block.rounded);
    step_.require_finite();
    return deepest;
}

// Restores points outside the advanced group.
void BlockRun::restore_others()
{
    PointBlock& block = step_.block;
    for (std::size_t i = 0; i < block.size(); ++i) {
        const std::uint32_t index = block.indices[i];
        if (context_.advances(index)) continue;
        block.P[i] = context_.P[index].cast<double>();
        block.v[i] = context_.v[index].cast<double>();
    }
}

BlockResult BlockRun::result(const Collisions& collisions)
{
    const PointBlock& block = step_.block;
    const StepScene& scene = context_.scene;
    // Under drag the path between contacts is not a parabola, and more substeps would find other contacts.
    const PathKind unbroken = scene.is_ballistic() && scene.uniform.linear.is_zero() ? PathKind::Exact
                              : scene.actions.empty()                                ? PathKind::Smooth
                                                                                     : PathKind::Acted;
    paths_.assign(block.size(), unbroken);
    position_errors_.assign(block.size(), 0);
    for (std::size_t i = 0; !scene.obstacles.empty() && i < block.size(); ++i) {
        if (collisions.has_met(i)) paths_[i] = PathKind::Broken;
        position_errors_[i] = collisions.position_error(i);
    }
    dead_.clear();
    if (!context_.dead.empty())
        for (const std::uint32_t index : block.indices) dead_.push_back(context_.dead[index]);
    return {block.indices, paths_, position_errors_, dead_, block.P, block.v, block.rounded, scene.obstacles};
}

}  // namespace

void UncoupledStep::run()
{
    context_.for_each_chunk([&](std::size_t begin, std::size_t end) { advance_chunk(begin, end); });
}

void UncoupledStep::advance_chunk(std::size_t begin, std::size_t end)
{
    const auto require_finite = [&](std::size_t from, std::size_t to, const PointErrors::Occasion& occasion) {
        context_.errors.require_finite(from, context_.P.subspan(from, to - from), context_.v.subspan(from, to - from),
                                       occasion);
    };
    std::vector<std::uint32_t> indices;
    if (context_.scene.is_ballistic() && context_.advances_all() && (!refinement_ || refinement_->takes_exact())) {
        const BallisticBatch::Progress progress = advance_ballistic(begin, end, indices);
        if (!progress.finite) require_finite(begin, progress.end, PointErrors::in_step_overwritten);
        require_finite(progress.end, end, PointErrors::before_step);
        if (indices.empty()) return;
    } else {
        require_finite(begin, end, PointErrors::before_step);
        indices.resize(end - begin);
        std::iota(indices.begin(), indices.end(), static_cast<std::uint32_t>(begin));
    }
    advance_by_substeps(indices);
}

// Advances the points that come near no shape in the whole frame, and lists the others.
BallisticBatch::Progress UncoupledStep::advance_ballistic(std::size_t begin, std::size_t end,
                                                          std::vector<std::uint32_t>& near)
{
    const Uniform& uniform = context_.scene.uniform;
    BallisticBatch batch(uniform.a + uniform.linear.ku, uniform.linear.k);
    for (const Obstacle& obstacle : context_.scene.obstacles) {
        float widest = 0;
        for (std::size_t i = begin; i < (obstacle.radius.stride ? end : begin + 1); ++i)
            widest = std::max(widest, obstacle.radius[i]);
        batch.avoid(obstacle.bounds, widest);
    }
    return batch.advance(context_.P, context_.v, context_.time, begin, end, near);
}

// Advances points of one chunk, in order; the whole chunk if forces or actions act.
void UncoupledStep::advance_by_substeps(std::span<const std::uint32_t> indices)
{
    // Contacts are counted in the first run of each block only.
    Collisions counted(context_.scene.obstacles, context_.collision_context());
    Collisions others(context_.scene.obstacles, context_.collision_context());
    BlockRun run(context_);
    const std::unique_ptr<BlockRefinement> refinement = refinement_ ? refinement_->begin() : nullptr;
    double deepest = 0;
    for (std::size_t begin = 0; begin < indices.size(); begin += block_size) {
        const std::span at = indices.subspan(begin, std::min(block_size, indices.size() - begin));
        if (refinement) refinement->begin(at);
        deepest = std::max(deepest, run.advance(counted, at, context_.options.substeps));
        if (!refinement) {
            run.store();
            continue;
        }
        int substeps = refinement->take(run.result(counted));
        for (; substeps > 0; substeps = refinement->take(run.result(others))) {
            if (!context_.dead.empty())
                for (const std::uint32_t index : at) context_.dead[index] = 0;
            deepest = std::max(deepest, run.advance(others, at, substeps));
        }
    }
    FrameFigures figures = counted.figures();
    figures.penetration_max = deepest;
    context_.count(figures, indices.front());
}

}  // namespace rapid
