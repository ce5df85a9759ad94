// A simulation, and the points and dynamics that flow from node to node.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "runtime/base/frame.h"
#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/dynamics.h"
#include "runtime/solver/estimate/resolution.h"
#include "runtime/solver/figures.h"
#include "runtime/solver/step_log.h"

namespace rapid {

// The events of a simulation's points in its last step, for emitters that use them as parents.
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

// The ids of points of one simulation in another one that has adopted them by a merge.
//
// A point keeps its adopted id in every later frame and through every merge. Points are born in runs of consecutive
// ids, so the table stores runs: a few words per frame, not eight bytes per point.
class AdoptedIds {
public:
    // Returns the adopted id of the point `id` of the other simulation. A new point takes `next`, the next free id
    // here.
    std::int64_t of(std::int64_t id, std::int64_t& next)
    {
        if (last_ < runs_.size() && runs_[last_].holds(id)) return runs_[last_].of(id);
        const auto after = std::upper_bound(runs_.begin(), runs_.end(), id, [](std::int64_t requested, const Run& run) {
            return requested < run.first;
        });
        if (after != runs_.begin()) {
            Run& before = *(after - 1);
            last_ = static_cast<std::size_t>(after - runs_.begin()) - 1;
            if (before.holds(id)) return before.of(id);
            if (id == before.first + before.size && next == before.adopted + before.size) {
                ++before.size;
                return next++;
            }
        }
        last_ = static_cast<std::size_t>(runs_.insert(after, Run{id, 1, next}) - runs_.begin());
        return next++;
    }

    std::size_t runs() const { return runs_.size(); }

private:
    struct Run {
        std::int64_t first, size;  // in the other simulation
        std::int64_t adopted;      // id of the first here

        bool holds(std::int64_t id) const { return id >= first && id < first + size; }
        std::int64_t of(std::int64_t id) const { return adopted + (id - first); }
    };

    std::vector<Run> runs_;  // in order of `first`
    std::size_t last_ = 0;   // run of the last query, which usually holds the next one too
};

// The findings of a run that examines only kernels and stiffness (Evaluator::examine), in its last subframe; `stiff` is
// of the whole frame. Emitters emit a sample, and Solve does not move points.
struct Trial {
    std::vector<Stiffness> stiff;
    Resolution resolution;
    std::uint64_t idle = 0;  // emitters that have emitted nothing so far
};

// One simulation: started by a Create, fed back by its Solve, shared by all flows from it.
struct Simulation {
    double fps = 24;
    std::int64_t start = 1;
    int subframes = 1;
    std::uint64_t seed = 0;
    std::int64_t next_id = 0;                         // ids count all births from 0
    std::vector<AttributeSpec> columns;               // existing from the first frame on, by the plan
    std::vector<std::string> groups;                  // likewise
    PointSet state;                                   // after the previous frame's Solve
    std::map<const Simulation*, AdoptedIds> adopted;  // ids of points of other simulations
    std::shared_ptr<StepRecord> record;               // of the last step; null if nothing reads it
    std::int64_t first_new = 0;                       // points with this id and above are born in the next step
    std::vector<std::int64_t> condemned;              // ids of points that emitters of other chains remove
    // Null except in a trial.
    std::shared_ptr<Trial> trial;
    std::map<std::string, std::vector<std::string>> varying;  // parameters that are functions of the frame, by node
    // By node: functions that return true if the end of a point's path in this step does not depend on its state before
    // it, as that of a point which a goal takes to its target. Errors until then end there.
    std::map<const void*, std::function<bool(const PointSet& points, std::size_t i)>> arrivals;
    bool estimates_errors = true;        // if false, Solve estimates none
    bool per_point_diagnostics = false;  // Solve stores per-point figures as attributes (solve/step_observers.cpp)

    FrameClock clock() const { return {fps, start, subframes}; }
    Frame frame(std::int64_t step) const { return clock().at_step(step); }
};

// The data on an edge of the graph.
struct Flow {
    PointSet points;
    Dynamics dynamics;  // of the nodes upstream
    std::shared_ptr<Simulation> simulation;
};

}  // namespace rapid
