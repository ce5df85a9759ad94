#include "runtime/solver/step_context.h"

#include <algorithm>
#include <utility>

#include "runtime/points/members.h"

namespace rapid {
namespace {

PointSet& with_needed_columns(PointSet& points, const Dynamics& dynamics)
{
    if (StuckColumns::are_needed(dynamics)) StuckColumns::add_to(points);
    return points;
}

}  // namespace

StepContext::StepContext(PointSet& set, const Dynamics& dynamics, const SolveOptions& solve_options)
    : points(with_needed_columns(set, dynamics)),
      options(solve_options),
      scene(set, dynamics, options.h),
      P(set.P().write()),
      v(set.v().write()),
      dead(scene.actions.empty() && !scene.kills ? 0 : set.size()),
      errors(set, options.frame)
{
    if (scene.records) hits_.emplace(points, options.begins_frame);
    if (StuckColumns::are_needed(dynamics)) stuck_.emplace(points);
    if (!options.group.empty()) members_ = members_of(points, options.group);
    time.h = options.h;
    if (points.has("dt")) time.own = points.column<float>("dt").read();
}

CollisionContext StepContext::collision_context()
{
    return {hits_ ? &*hits_ : nullptr,
            dead,
            options.sinks.met,
            scene.mass,
            options.time,
            options.h,
            options.sinks.log,
            stuck_ ? &*stuck_ : nullptr,
            scene.actions.empty() ? 1 : 2};
}

void StepContext::count(FrameFigures of_chunk, std::size_t first)
{
    const std::scoped_lock lock(mutex_);
    energies_.emplace_back(first, std::exchange(of_chunk.contact_energy, {}));
    figures_.add(of_chunk);
}

void StepContext::remove_dead()
{
    if (std::find(dead.begin(), dead.end(), 1) == dead.end()) return;
    if (options.sinks.log) options.sinks.log->take_dead(points, dead);
    for (std::uint8_t& killed : dead) killed = !killed;
    const std::size_t before = points.size();
    points.keep(dead);
    figures_.died = before - points.size();
}

FrameFigures StepContext::take_figures()
{
    // In the order of the points, because a sum of doubles depends on it.
    std::stable_sort(energies_.begin(), energies_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [first, energy] : energies_) figures_.contact_energy += energy;
    return std::move(figures_);
}

}  // namespace rapid
