// The native functions of lua/detail.lua: they work on the set of the running :detail function.
#pragma once

#include <map>

#include "runtime/graph/step_record.h"
#include "runtime/points/neighbours.h"
#include "runtime/points/point_set.h"

namespace rapid {

class State;

// A run of a :detail function on a set, in the main state; one at a time. When it ends, views of its points are no
// longer valid, and the stack is as before.
class DetailRun {
public:
    // record: of the last step of the simulation; null where the graph keeps none.
    DetailRun(State& state, PointSet& of, const StepRecord* record);
    ~DetailRun();
    DetailRun(const DetailRun&) = delete;
    DetailRun& operator=(const DetailRun&) = delete;

    PointSet& points;
    const StepRecord* const record;
    // By radius, of the positions at the first search.
    std::map<double, Neighbours> neighbours;

    void changed() { neighbours.clear(); }

private:
    State& state_;
    const int top_;
};

// Pushes the table of native functions.
void push_detail_natives(State& state);

}  // namespace rapid
