// Native functions of lua/detail.lua, which act on the set of the running :detail function.
#pragma once

#include <map>

#include "runtime/graph/simulation.h"
#include "runtime/points/neighbours.h"
#include "runtime/points/point_set.h"

namespace rapid {

class State;

// A run of a :detail function on a set, in the main state; one at a time. Its destructor invalidates the views of its
// points and restores the stack.
class DetailRun {
public:
    // record: the last step of the simulation; null if the graph records none.
    DetailRun(State& state, PointSet& of, const StepRecord* record);
    ~DetailRun();
    DetailRun(const DetailRun&) = delete;
    DetailRun& operator=(const DetailRun&) = delete;

    PointSet& points;
    const StepRecord* const record;
    // Neighbour searches by radius, over the positions at the first search.
    std::map<double, Neighbours> neighbours;

    void changed() { neighbours.clear(); }

private:
    State& state_;
    const int top_;
};

// Pushes the table of native functions.
void push_detail_natives(State& state);

}  // namespace rapid
