// The state of a simulation (points/state_archive.h): its points, the ids given, and what happened in the last step.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/graph/simulation.h"
#include "runtime/points/state_archive.h"
#include "runtime/points/state_checks.h"

namespace rapid {

constexpr std::int64_t most_ids = std::int64_t{1} << 53;

// Whether the points have ids of their own, of those that were given so far.
inline bool have_ids_below(const PointSet& points, std::int64_t next_id)
{
    const auto* column = points.find<std::int64_t>("id");
    if (!column || (column->is_uniform() && column->size() > 1)) return false;
    std::span<const std::int64_t> ids(column->read().data, column->size());
    std::vector<std::int64_t> sorted;  // where a script or a merge has put them into another order
    if (!ascend(ids)) {
        sorted.assign(ids.begin(), ids.end());
        std::sort(sorted.begin(), sorted.end());
        ids = sorted;
    }
    return ids.empty() || (ids.front() >= 0 && ids.back() < next_id && ascend(ids));
}

template <StateArchive Archive>
void serialize(Archive& keep, LoggedHit& hit)
{
    keep(hit.point, hit.collider, hit.time, hit.P, hit.n, hit.vc, hit.v0, hit.v1, hit.speed, hit.impulse, hit.recorded);
}

template <StateArchive Archive>
void serialize(Archive& keep, StepRecord& step)
{
    keep(step.time, step.h, step.first_new, step.before, step.hits, step.killed, step.old, step.killed_at, step.old_at,
         step.has_contacts);
    if constexpr (Archive::is_loading::value) {
        const auto is_of_a_point = [&](const LoggedHit& hit) { return hit.point < step.before.size(); };
        const auto by_point = [](const LoggedHit& a, const LoggedHit& b) { return a.point < b.point; };
        StateReader::expect(std::all_of(step.hits.begin(), step.hits.end(), is_of_a_point));
        StateReader::expect(std::is_sorted(step.hits.begin(), step.hits.end(), by_point));
        StateReader::expect(step.killed_at.size() == step.killed.size() && step.old_at.size() == step.old.size());
        StateReader::expect(std::isfinite(step.time) && std::isfinite(step.h));
    }
}

// The ids of adopted points are kept by the merges that have adopted them.
template <StateArchive Archive>
void serialize(Archive& keep, Simulation& simulation)
{
    keep(simulation.next_id, simulation.state, simulation.first_new);
    if (simulation.record) keep(*simulation.record);
    if constexpr (Archive::is_loading::value) {
        StateReader::expect(0 <= simulation.next_id && simulation.next_id <= most_ids);
        StateReader::expect(have_ids_below(simulation.state, simulation.next_id));
        if (!simulation.record) return;
        for (const PointSet* set : {&simulation.record->before, &simulation.record->killed, &simulation.record->old})
            StateReader::expect(have_ids_below(*set, simulation.next_id));
    }
}

}  // namespace rapid
