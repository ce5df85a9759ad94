#include "runtime/solver/constraints/projection.h"

#include <algorithm>

#include "runtime/parallel.h"

namespace rapid {

Projection::Projection(std::span<const LocalConstraint> constraints, std::span<const Obstacle> obstacles,
                       std::size_t size)
    : constraints_(constraints), free_(size)
{
    if (!obstacles.empty()) shapes_.emplace(obstacles, size);
}

template <class F>
void Projection::each(const F& f)
{
    for (const LocalConstraint& local : constraints_) {
        try {
            f(*local.coupling);
        } catch (Error& error) {
            error.in_node(local.constraint->node).at(local.constraint->location);
            throw;
        }
    }
}

void Projection::open(const Substep& now, const ShapeLoads* loads, const Column<std::int64_t>& ids)
{
    if (shapes_ && loads && now.dt > 0) shapes_->recall(*loads, ids, now.dt);
}

void Projection::advance(Substep& now)
{
    if (!(now.dt > 0)) return;
    if (now.sleepers) now.sleepers->rouse(now);
    each([&](Coupling& coupling) { coupling.resume(now); });
    each([&](Coupling& coupling) { coupling.hold(now); });
    find_borne(now);
    each([&](Coupling& coupling) { coupling.rouse(now); });
    for_each_chunk(now.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) free_[i] = now.at[i].P;
    });
    each([&](Coupling& coupling) { coupling.prepare(now); });
    if (shapes_) shapes_->prepare(now, free_);
    for (int k = 0; k < now.iterations; ++k) {
        each([&](Coupling& coupling) { coupling.project(now); });
        if (shapes_) shapes_->project(now);
    }
    for_each_chunk(now.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) now.v[i] += (now.at[i].P - free_[i]) / now.dt;
    });
    each([&](Coupling& coupling) { coupling.suspend(now); });
    each([&](Coupling& coupling) { coupling.settle(now); });
    if (shapes_) shapes_->settle(now);
    each([&](Coupling& coupling) { coupling.take_back(now); });
}

// What no constraint moves bears, as shapes do.
void Projection::find_borne(Substep& now)
{
    borne_.resize(now.size());
    found_borne_.resize(now.size());
    std::swap(borne_, found_borne_);
    for (std::size_t i = 0; i < now.size(); ++i) {
        if (!(now.at[i].w > 0)) borne_[i] = 255;
        found_borne_[i] = 0;
    }
    now.borne = borne_;
    now.found_borne = found_borne_;
}

Residual Projection::close(Substep& now, ShapeLoads* loads, const Column<std::int64_t>& ids)
{
    Residual all;
    if (!(now.dt > 0)) return all;
    each([&](Coupling& coupling) {
        const Residual residual = coupling.close(now);
        all.worst = std::max(all.worst, residual.worst);
        all.rows += residual.rows;
        all.loose += residual.loose;
        if (residual.search) all.search = residual.search;
    });
    if (shapes_ && loads) shapes_->remember(*loads, ids, now.dt);
    return all;
}

}  // namespace rapid
