// Runs :detail, a Lua function over a whole set of points.
#pragma once

#include <map>
#include <string>

#include "runtime/graph/node.h"
#include "runtime/graph/simulation.h"
#include "runtime/points/neighbours.h"
#include "runtime/points/point_set.h"

namespace rapid {

class Kernel;
struct KernelArguments;

// Calls function(points, frame, params) once, in the main state. Afterwards the points that it added are appended, with
// new ids, and those that it killed are removed. Rethrows the function's error with the frame.
void run_detail(const Kernel& function, Flow& flow, const Evaluation& now, const KernelArguments& arguments);

// Returns the detail values as scripts see them.
std::map<std::string, Value> values_of(const std::map<std::string, DetailValue, std::less<>>& details);

// Native functions of lua/detail.lua, which act on the set of the running :detail function.

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
