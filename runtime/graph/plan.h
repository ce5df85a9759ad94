// The plan of a run: what the requested outputs need, found before the first frame.
//
// Backward from the outputs it finds the nodes that are reached, in an order in which inputs come first; the simulation
// of each (a Create and the one Solve that feeds it back); the attributes and groups that are live (attribute_uses.h);
// and the nodes whose result never changes. Every error that does not need a frame to be run is found here.
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

// The result of a graph file.
struct Graph {
    std::string file;
    std::map<std::string, NodePtr> outputs;  // a single one is called "main"
    std::vector<NodePtr> nodes;              // all that were made, reached or not
};

struct PlanOptions {
    std::optional<std::uint64_t> seed;    // replaces each create's seed
    std::vector<std::string> attributes;  // attributes and groups that outputs ask for by name
    bool all_made = true;                 // an output asks for all that the scene makes
    bool keep_steps = false;              // keeps what happens to the points in each step, for FrameResult::steps
    bool keep_all = false;                // leaves nothing out and evaluates nothing once, to the same bits
};

// An attribute or a group of a simulation's points, and its users, as indices into Plan::nodes.
struct PlannedAttribute {
    std::string name;  // a group's with group_prefix
    AttributeSpec spec;
    bool group = false;
    bool always = false;  // P, v, id
    std::vector<std::size_t> made_by, written_by, read_by;
    bool asked_by_name = false;  // by an output
    bool asked_as_made = false;  // by an output that takes all that the scene makes
    bool kept = false;
    bool kept_for_merge = false;    // for the set alone into which the points of this simulation are merged
    bool used_before_made = false;  // a known one: by a node before those that make it

    // Whether an output that names no attributes has it.
    bool is_of_scene() const { return always || !made_by.empty() || !written_by.empty() || !read_by.empty(); }
    std::size_t bytes_per_point() const;  // where the column is not uniform
};

struct PlannedSimulation {
    NodePtr create, solve;  // solve may be null
    double fps = 24;
    std::int64_t start = 1;
    int subframes = 1;
    std::uint64_t seed = 0;
    bool recorded = false;                     // whether Solve keeps what happens in a step, for emitters
    std::vector<PlannedAttribute> attributes;  // all that are known or made, in order of name
    std::set<std::string> left_out;            // names of those that are not kept

    const PlannedAttribute* find(std::string_view name) const;
};

struct PlannedNode {
    NodePtr node;
    std::shared_ptr<Operator> op;
    std::vector<std::size_t> inputs;          // indices into Plan::nodes
    std::vector<std::size_t> sources;         // likewise, of the nodes among its arguments: their points it only reads
    std::vector<AttributeSpec> source_makes;  // what the nodes up to these make
    std::size_t consumers = 0;                // of its result, outputs and readers included
    std::size_t simulation = 0;               // index into Plan::simulations
    std::set<std::size_t> carries;            // the simulations whose points pass through it
    bool in_loop = false;                     // from its Create to its Solve, both included
    bool in_steps = false;                    // evaluated in each sub-frame: in_loop, or upstream of a source in a loop
    bool once = false;                        // evaluated once: its result never changes
    std::string changes;                      // why its result changes; empty where it does not
    std::set<std::string> reached_from;       // names of outputs
};

class Plan {
public:
    // Error: no output; a parameter that is unknown, missing, of the wrong type or out of range; a second Solve after
    // one Create (naming both); an attribute or group that nothing makes (with the nearest name); two types for one
    // name.
    Plan(const Graph& graph, const PlanOptions& options);

    std::vector<PlannedNode> nodes;
    std::vector<PlannedSimulation> simulations;
    std::map<std::string, std::size_t> outputs;  // index into `nodes` by name
    std::vector<NodePtr> left_out;               // nodes that no output depends on
    bool keeps_all = false;
    bool keeps_steps = false;
    std::vector<std::string> warnings;  // of doubtful graphs: a write node that is not reached

    // The columns and groups that the points of a simulation have from its first frame on. The fallbacks follow from
    // the current arguments of the nodes.
    std::vector<AttributeSpec> columns_of(std::size_t simulation) const;
    std::vector<std::string> groups_of(std::size_t simulation) const;

    // The last node of the fused edits that begin with node `first`: neighbours that edit points one by one, whose
    // results have no other consumer. A node that reads point indices does not follow one that removes points.
    std::size_t last_together(std::size_t first) const;

    // The nodes of each pass over the points, in order: a Solve with the dynamics upstream of it, fused edits, or a
    // single node.
    std::vector<std::vector<std::size_t>> passes() const;

    // The names of all points of the scene, whether they are kept or not; groups without the prefix.
    std::set<std::string> names_of_scene() const;

    // The columns of a node's result that are there for another reason than its points: another output asks for them by
    // name, other points have them, or nothing is left out.
    std::set<std::string> unasked_columns(std::size_t node) const;

    // The earliest first frame of the simulations.
    std::int64_t first_frame() const;

private:
    void collect_nodes(const Graph& graph);
    void find_simulations();
    void start_simulation(PlannedNode& create);
    void feed_back(const PlannedNode& solve);
    void find_steps();
    void check_source(const PlannedNode& planned, std::size_t source);
    void find_made_by_sources(PlannedNode& planned) const;
    void bind_all();
    void find_changes();
    void warn_of_idle_nodes();
};

// The uses of a node: those of its type, its own, and those of its arguments.
Uses uses_of(const PlannedNode& planned);

}  // namespace rapid
