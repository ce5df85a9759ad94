#include "runtime/solver/solve.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/solver/block_step.h"
#include "runtime/solver/coupled_step.h"
#include "runtime/solver/point_errors.h"
#include "runtime/solver/step_context.h"

namespace rapid {

// A step of points that do not depend on one another: each block goes through the whole frame while it is in cache.
//
// This exists alongside the coupled step, in which the substep is a barrier, because main memory is then read and
// written once per frame for any number of substeps. Points moved only by a uniform acceleration and linear drag take
// no substeps at all (motion/ballistic_batch.h).
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

namespace {

// Returns the values from begin to end, or the single value of a uniform column.
std::span<const Vec3f> values(const Strided<Vec3f>& column, std::size_t begin, std::size_t end)
{
    return {&column[begin], column.stride == 0 ? 1 : end - begin};
}

void require_finite(const PointSet& points, const SolveOptions& options)
{
    const PointErrors errors(points, options.frame);
    const Strided<Vec3f> P = points.P().read(), v = points.v().read();
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        if (all_finite(values(P, begin, end)) && all_finite(values(v, begin, end))) return;
        for (std::size_t i = begin; i < end; ++i) errors.require_finite(i, P[i], v[i], PointErrors::before_step);
    });
}

// Returns true if nothing acts on the points and they are at rest, which a uniform velocity shows without a scan.
bool nothing_moves(const PointSet& points, const Dynamics& dynamics)
{
    const Strided<Vec3f> v = points.v().read();
    return dynamics.empty() && v.stride == 0 && v[0].isZero(0) && !nonzero_forces_of(points);
}

FrameFigures advance(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, Refinement* refinement)
{
    RAPID_ASSERT(options.substeps >= 1 && std::isfinite(options.h) && options.h >= 0);
    // Interacting points are checked before their constraints or interactions begin.
    if (!dynamics.constraints().empty() || options.interacts) require_finite(points, options);
    StepContext context(points, dynamics, options);
    if (context.scene.constraints.empty() && !options.interacts)
        UncoupledStep(context, refinement).run();
    else
        CoupledStep(context, dynamics).run();
    if (!refinement) context.remove_dead();
    return context.take_figures();
}

}  // namespace

FrameFigures solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options)
{
    if (points.empty()) return {};
    if (nothing_moves(points, dynamics)) return require_finite(points, options), FrameFigures();
    FrameFigures figures = advance(points, dynamics, options, nullptr);
    if (auto* force = points.find<Vec3f>("force")) force->fill(Vec3f::Zero());
    return figures;
}

FrameFigures solve(PointSet& points, const Dynamics& dynamics, const SolveOptions& options, Refinement& refinement)
{
    RAPID_ASSERT(dynamics.constraints().empty());
    return points.empty() ? FrameFigures() : advance(points, dynamics, options, &refinement);
}

bool is_closed_form(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options)
{
    if (!options.group.empty() || nonzero_forces_of(points)) return false;
    if (!dynamics.actions().empty() || !dynamics.colliders().empty() || !dynamics.constraints().empty()) return false;
    return std::all_of(dynamics.forces().begin(), dynamics.forces().end(), [](const auto& force) {
        const std::optional<Uniform> uniform = force->uniform();
        return uniform && force->group.empty() && has_closed_form(uniform->linear);
    });
}

}  // namespace rapid
