// A simulation, and the points and dynamics that flow from node to node.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "runtime/frame.h"
#include "runtime/graph/adopted_ids.h"
#include "runtime/graph/step_record.h"
#include "runtime/points/point_set.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

// One simulation: started by a Create, fed back by its Solve, shared by all flows that come from it.
struct Simulation {
    double fps = 24;
    std::int64_t start = 1;
    int subframes = 1;
    std::uint64_t seed = 0;
    std::int64_t next_id = 0;                         // ids count all births from 0
    std::vector<AttributeSpec> columns;               // that exist from the first frame on, by the plan
    std::vector<std::string> groups;                  // likewise
    PointSet state;                                   // after the previous frame's Solve
    std::map<const Simulation*, AdoptedIds> adopted;  // ids of points of other simulations
    std::shared_ptr<StepRecord> record;               // of the last step; null where nothing reads it
    std::int64_t first_new = 0;                       // points with this id and above are born in the next step
    std::vector<std::int64_t> condemned;              // ids of points that emitters of other chains take away
    // Only kernels and stiffness are examined: emitters emit a sample, and Solve does not move points.
    bool trial = false;
    std::map<std::string, std::vector<std::string>> varying;  // parameters that are functions of the frame, by node
    bool estimates_errors = true;                             // where false, Solve tells none
    bool tells_points = false;  // Solve tells of each point, as attributes of its result (solve/point_figures.h)

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
