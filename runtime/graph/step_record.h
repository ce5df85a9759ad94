// What happened to the points of a simulation in its last step: for those that are born from them.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/solver/step_log.h"

namespace rapid {

struct StepRecord {
    double time = 0;                  // its end, s since the start
    double h = 0;                     // its length, s; 0 at the start, before any dynamics
    std::int64_t first_new = 0;       // points with this id and above were born in it
    PointSet before;                  // as they entered Solve
    std::vector<LoggedHit> hits;      // by place in `before`, then by time
    std::vector<LoggedBreak> breaks;  // in the order of time; not in snapshots, as no emitter reads them

    // Those that died in it, with the times, s since the start: killed ones are as they were then, old ones have moved
    // on to the end of the step.
    PointSet killed, old;
    std::vector<double> killed_at, old_at;

    // Whether contacts, and deaths by them and by actions, are known: not where Solve has a tolerance, and takes points
    // through the step several times.
    bool has_contacts = true;
};

}  // namespace rapid
