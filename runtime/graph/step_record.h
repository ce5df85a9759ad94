// The events of a simulation's points in its last step, for emitters that use them as parents.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/step_log.h"

namespace rapid {

struct StepRecord {
    double time = 0;                  // end of the step, s since the start
    double h = 0;                     // length of the step, s; 0 at the start, before any dynamics
    std::int64_t first_new = 0;       // points with this id and above were born in it
    PointSet before;                  // as they entered Solve
    std::vector<LoggedHit> hits;      // by index in `before`, then by time
    std::vector<LoggedBreak> breaks;  // by time; not in snapshots, because no emitter reads them

    // Points that died in the step, with the times, s since the start: killed ones have their state at death, old ones
    // moved on to the end of the step.
    PointSet killed, old;
    std::vector<double> killed_at, old_at;

    // False if contacts, and deaths by them and by actions, are unknown: a Solve with a tolerance takes points through
    // the step several times.
    bool has_contacts = true;
};

}  // namespace rapid
