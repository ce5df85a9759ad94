#include "runtime/solver/solve.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/parallel.h"
#include "runtime/solver/coupled_step.h"
#include "runtime/solver/point_errors.h"
#include "runtime/solver/step_context.h"
#include "runtime/solver/uncoupled_step.h"

namespace rapid {
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
