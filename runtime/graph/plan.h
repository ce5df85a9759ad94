// The plan of a run: everything that the requested outputs need, found before the first frame.
//
// Backward from the outputs it finds the reached nodes, ordered so that inputs come first; the simulation of each (a
// Create and the single Solve that feeds it back); the live attributes and groups (attribute_uses.h); and the nodes
// whose result never changes. Every error that can be found without running a frame is found here.
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
    std::vector<NodePtr> nodes;              // all that were created, reached or not
};

struct PlanOptions {
    std::optional<std::uint64_t> seed;    // replaces each create's seed
    std::vector<std::string> attributes;  // attributes and groups that outputs request by name
    bool all_made = true;                 // an output requests all attributes that the scene makes
    bool keep_steps = false;              // stores the events of each step, for FrameResult::steps
    bool keep_all = false;                // prunes nothing and evaluates nothing once; results are bit-identical
};

// An attribute or a group of a simulation's points, and its users, as indices into Plan::nodes.
struct PlannedAttribute {
    std::string name;  // a group's has group_prefix
    AttributeSpec spec;
    bool group = false;
    bool always = false;  // P, v, id
    std::vector<std::size_t> made_by, written_by, read_by;
    bool requested_by_name = false;  // by an output
    bool requested_as_made = false;  // by an output that takes all that the scene makes
    bool kept = false;
    bool kept_for_merge = false;    // only for the set into which the points of this simulation are merged
    bool used_before_made = false;  // known attribute: used by a node before the nodes that make it

    // Returns true if an output that names no attributes has it.
    bool is_of_scene() const { return always || !made_by.empty() || !written_by.empty() || !read_by.empty(); }
    std::size_t bytes_per_point() const;  // if the column is not uniform
};

struct PlannedSimulation {
    NodePtr create, solve;  // solve may be null
    double fps = 24;
    std::int64_t start = 1;
    int subframes = 1;
    std::uint64_t seed = 0;
    bool recorded = false;                     // Solve stores the events of a step, for emitters
    std::vector<PlannedAttribute> attributes;  // all that are known or made, in order of name
    std::set<std::string> pruned;              // names of pruned attributes

    const PlannedAttribute* find(std::string_view name) const;
};

struct PlannedNode {
    NodePtr node;
    std::shared_ptr<Operator> op;
    std::vector<std::size_t> inputs;          // indices into Plan::nodes
    std::vector<std::size_t> sources;         // likewise, for the nodes among its arguments, whose points it only reads
    std::vector<AttributeSpec> source_makes;  // attributes made by the nodes up to its sources
    std::size_t consumers = 0;                // of its result, including outputs and readers
    std::size_t simulation = 0;               // index into Plan::simulations
    std::set<std::size_t> carries;            // the simulations whose points pass through it
    bool in_loop = false;                     // from its Create to its Solve, inclusive
    bool in_steps = false;                    // evaluated in each subframe: in_loop, or upstream of a source in a loop
    bool once = false;                        // evaluated once: its result never changes
    std::string changes;                      // why its result changes; empty if it does not
    std::set<std::string> reached_from;       // names of outputs
};

class Plan {
public:
    // Throws Error if there is no output; if a parameter is unknown, missing, of the wrong type or out of range; if a
    // second Solve follows one Create (naming both); if nothing makes an attribute or group (with the nearest name);
    // or if one name has two types.
    Plan(const Graph& graph, const PlanOptions& options);

    std::vector<PlannedNode> nodes;
    std::vector<PlannedSimulation> simulations;
    std::map<std::string, std::size_t> outputs;  // index into `nodes` by name
    std::vector<NodePtr> pruned;                 // nodes that no output depends on
    bool keeps_all = false;
    bool keeps_steps = false;
    std::vector<std::string> warnings;  // about doubtful graphs, e.g. a write node that is not reached

    // Return the columns and groups that the points of a simulation have from its first frame on. The fallbacks depend
    // on the current arguments of the nodes.
    std::vector<AttributeSpec> columns_of(std::size_t simulation) const;
    std::vector<std::string> groups_of(std::size_t simulation) const;

    // Returns the last node of the fused edits that begin with node `first`: neighbours that edit points one by one,
    // and whose results have no other consumer. A node that reads point indices does not follow one that removes
    // points.
    std::size_t last_together(std::size_t first) const;

    // Returns the nodes of each pass over the points, in order: a Solve with the dynamics upstream of it, fused edits,
    // or a single node.
    std::vector<std::vector<std::size_t>> passes() const;

    // Returns the names of all attributes and groups of the scene, kept or not; groups without the prefix.
    std::set<std::string> names_of_scene() const;

    // Returns the columns of a node's result that its output did not request: another output requests them by name,
    // other points have them, or nothing is pruned.
    std::set<std::string> unrequested_columns(std::size_t node) const;

    // Returns the earliest first frame of the simulations.
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

// Returns the uses of a node: those of its type, its own, and those of its arguments.
Uses uses_of(const PlannedNode& planned);

}  // namespace rapid
