// What has to be done for the requested outputs, found before the first frame.
//
// From the outputs backward: the nodes that are reached, in an order in which inputs come first; the simulation that
// each belongs to (a Create and the one Solve that feeds it back); the attributes that must exist; the nodes whose
// result never changes. All that can be wrong without running a frame is found here.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/graph/node.h"

namespace rapid {

// What a graph file yields.
struct Graph {
    std::string file;
    std::map<std::string, NodePtr> outputs;  // a single one is called "main"
    std::vector<NodePtr> nodes;              // all that were made, reached or not
};

struct PlanOptions {
    std::optional<std::uint64_t> seed;    // replaces each create's seed
    std::vector<std::string> attributes;  // asked for by outputs, besides what the scene made
};

struct PlannedSimulation {
    NodePtr create, solve;  // solve may be null
    double fps = 24;
    std::int64_t start = 1;
    std::uint64_t seed = 0;
};

struct PlannedNode {
    NodePtr node;
    std::shared_ptr<Operator> op;
    std::vector<std::size_t> inputs;  // places in Plan::nodes
    std::size_t consumers = 0;        // that take its result, outputs included
    std::size_t simulation = 0;       // place in Plan::simulations
    bool in_loop = false;             // between its Create and Solve, both included
    bool once = false;                // its result never changes
};

class Plan {
public:
    // Error: no output; a parameter that is unknown, missing, of the wrong type or out of range; a second Solve after
    // one Create (naming both); an attribute or group that nothing makes (with the nearest name); two types for one
    // name.
    Plan(const Graph& graph, const PlanOptions& options);

    std::vector<PlannedNode> nodes;
    std::vector<PlannedSimulation> simulations;
    std::map<std::string, std::size_t> outputs;  // name -> place in `nodes`
    std::vector<std::string> warnings;           // usable but doubtful: a node that writes and is not reached

    // The columns and groups that the points of a simulation have from its first frame on, with the fallbacks that the
    // nodes' arguments have now.
    std::vector<AttributeSpec> columns_of(std::size_t simulation) const;
    std::vector<std::string> groups_of(std::size_t simulation) const;

    // The first frame of all simulations.
    std::int64_t first_frame() const;

private:
    void find_simulations();
    bool brings_other_points(const PlannedNode& planned) const;
    void check_names(const PlanOptions& options);

    std::vector<std::vector<std::string>> known_names_;  // by simulation: known attributes that something asks for
};

// Puts the arguments, with functions asked at this frame, into the node's fields. A fresh operator gets all of them;
// later calls only those that are functions.
void bind_arguments(const Node& node, Operator& op, const Frame& frame, bool only_functions);

}  // namespace rapid
