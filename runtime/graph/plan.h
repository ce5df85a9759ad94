// What has to be done for the requested outputs, found before the first frame.
//
// From the outputs backward: the nodes that are reached, in an order in which inputs come first; the simulation that
// each belongs to (a Create and the one Solve that feeds it back); the attributes and groups that something needs, and
// what does; the nodes whose result never changes. All that can be wrong without running a frame is found here.
//
// An attribute is needed where a node reads it, where an output asks for it, or where a script writes it and so must
// have a place to write to. What only is made is left out: no node makes it then.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
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
    std::vector<std::string> attributes;  // attributes and groups that outputs ask for by name
    bool all_made = true;                 // an output asks for all that the scene makes
    // Nothing is left out and nothing evaluated once: what the asked-for columns hold is the same bits.
    bool keep_all = false;
};

// An attribute or a group of a simulation's points, and who needs it. Nodes are places in Plan::nodes.
struct PlannedAttribute {
    std::string name;  // of a group with group_prefix
    AttributeSpec spec;
    bool group = false;
    bool always = false;  // P, v, id
    std::vector<std::size_t> made_by, written_by, read_by;
    bool asked_by_name = false;  // by an output
    bool asked_as_made = false;  // by an output that takes all that the scene makes
    bool kept = false;

    // Whether an output that names no attributes has it.
    bool is_of_scene() const { return always || !made_by.empty() || !written_by.empty() || !read_by.empty(); }
    std::size_t bytes_per_point() const;  // where points differ in it
};

struct PlannedSimulation {
    NodePtr create, solve;  // solve may be null
    double fps = 24;
    std::int64_t start = 1;
    int subframes = 1;
    std::uint64_t seed = 0;
    std::vector<PlannedAttribute> attributes;  // in order of name; all that are known or made
    std::set<std::string> left_out;            // of them, those that are not kept

    const PlannedAttribute* find(std::string_view name) const;
};

struct PlannedNode {
    NodePtr node;
    std::shared_ptr<Operator> op;
    std::vector<std::size_t> inputs;     // places in Plan::nodes
    std::size_t consumers = 0;           // that take its result, outputs included
    std::size_t simulation = 0;          // place in Plan::simulations
    std::set<std::size_t> carries;       // simulations whose points come through it
    bool in_loop = false;                // between its Create and Solve, both included
    bool once = false;                   // its result never changes
    std::string changes;                 // why it does
    std::set<std::string> reached_from;  // outputs
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
    std::vector<NodePtr> left_out;               // nodes that no output comes from
    bool keeps_all = false;
    std::vector<std::string> warnings;  // usable but doubtful: a node that writes and is not reached

    // The columns and groups that the points of a simulation have from its first frame on, with the fallbacks that the
    // nodes' arguments have now.
    std::vector<AttributeSpec> columns_of(std::size_t simulation) const;
    std::vector<std::string> groups_of(std::size_t simulation) const;

    // The last of the nodes that go over the points together with this one, the first of them: neighbours that edit
    // them one by one, whose results nothing else takes, and none of which asks for places behind one that removes
    // points.
    std::size_t last_together(std::size_t first) const;

    // The nodes that go over the points together, in the order of the passes: a Solve takes the dynamics upstream of it
    // along, and neighbouring edits each other.
    std::vector<std::vector<std::size_t>> passes() const;

    // The names that outputs get without asking for one, of all simulations; groups without the prefix.
    std::set<std::string> names_of_scene() const;

    // The first frame of all simulations.
    std::int64_t first_frame() const;

private:
    void find_simulations();
    void find_changes();
    void check_names() const;
    void find_attributes(std::size_t simulation, const PlanOptions& options);
};

// What a node uses: by its type, by itself, and by its arguments.
Uses uses_of(const PlannedNode& planned);

// Puts the arguments, with functions asked at this frame, into the node's fields. A fresh operator gets all of them;
// later calls only those that are functions.
void bind_arguments(const Node& node, Operator& op, const Frame& frame, bool only_functions);

}  // namespace rapid
