#include "runtime/solver/constraints/projection.h"

#include <algorithm>

#include "runtime/parallel.h"
#include "runtime/solver/constraints/sleep.h"

namespace rapid {

Projection::Projection(std::span<const LocalConstraint> constraints, std::span<const Obstacle> obstacles,
                       const Substep& step, Sleep* sleep, const ShapeLoads* loads, const Column<std::int64_t>& ids)
    : constraints_(constraints), sleep_(sleep), free_(step.size())
{
    if (!obstacles.empty()) shapes_.emplace(obstacles, step.size(), sleep);
    if (shapes_ && loads && step.dt > 0) shapes_->recall(*loads, ids, step.dt);
    for (const LocalConstraint& local : constraints_) local.coupling->join(sleep);
}

template <class F>
void Projection::each(const F& f)
{
    for (const LocalConstraint& local : constraints_) at_node(*local.constraint, [&] { f(*local.coupling); });
}

void Projection::advance(Substep& step)
{
    if (!(step.dt > 0) || (sleep_ && sleep_->all())) return;
    if (sleep_) sleep_->wake_islands_now(step);
    each([&](Coupling& coupling) { coupling.subtract_half_kick(step); });
    each([&](Coupling& coupling) { coupling.move_kinematic(step); });
    begin_support(step);
    each([&](Coupling& coupling) { coupling.detect(step); });
    for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) free_[i] = step.points[i].P;
    });
    each([&](Coupling& coupling) { coupling.warm_start(step); });
    if (shapes_) shapes_->warm_start(step, free_);
    for (int k = 0; k < step.iterations; ++k) {
        each([&](Coupling& coupling) { coupling.project(step); });
        if (shapes_) shapes_->project(step);
    }
    for_each_chunk(step.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) step.v[i] += (step.points[i].P - free_[i]) / step.dt;
    });
    each([&](Coupling& coupling) { coupling.add_half_kick(step); });
    each([&](Coupling& coupling) { coupling.solve_velocities(step); });
    if (shapes_) shapes_->solve_velocities(step);
    each([&](Coupling& coupling) { coupling.correct_penetration(step); });
}

// Points that no constraint moves support others, as shapes do.
void Projection::begin_support(Substep& step)
{
    support_.resize(step.size());
    next_support_.resize(step.size());
    std::swap(support_, next_support_);
    for (std::size_t i = 0; i < step.size(); ++i) {
        if (!(step.points[i].w > 0)) support_[i] = 255;
        next_support_[i] = 0;
    }
    step.support = support_;
    step.next_support = next_support_;
}

Residual Projection::close(Substep& step, ShapeLoads* loads, const Column<std::int64_t>& ids)
{
    Residual all;
    if (!(step.dt > 0)) return all;
    each([&](Coupling& coupling) {
        const Residual residual = coupling.close(step);
        all.worst = std::max(all.worst, residual.worst);
        all.rows += residual.rows;
        all.loose += residual.loose;
        if (residual.search) all.search = residual.search;
    });
    if (shapes_ && loads) shapes_->remember(*loads, ids, step.dt);
    return all;
}

}  // namespace rapid
