// The state of a simulation (points/state_archive.h): its points, the ids given, and what happened in the last step.
#pragma once

#include "runtime/graph/simulation.h"
#include "runtime/points/state_archive.h"

namespace rapid {

template <StateArchive Archive>
void serialize(Archive& keep, LoggedHit& hit)
{
    keep(hit.point, hit.collider, hit.time, hit.P, hit.n, hit.vc, hit.v0, hit.v1, hit.speed, hit.impulse);
}

template <StateArchive Archive>
void serialize(Archive& keep, StepRecord& step)
{
    keep(step.time, step.h, step.first_new, step.before, step.hits, step.killed, step.old, step.killed_at, step.old_at,
         step.has_contacts);
}

// The ids of adopted points are kept by the merges that have adopted them.
template <StateArchive Archive>
void serialize(Archive& keep, Simulation& simulation)
{
    keep(simulation.next_id, simulation.state, simulation.first_new);
    if (simulation.record) keep(*simulation.record);
}

}  // namespace rapid
