// Finds the attributes and groups that the points of a simulation need, and the nodes that make, write and read them:
// a liveness analysis over the nodes of a plan.
//
// An attribute is live if a node reads it, an output requests it, a node writes it and so needs a column, or its
// points are merged into a set that has it. An attribute that is only made is pruned: no node makes it then.
// makes it then.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/plan.h"

namespace rapid {

// Finds the attributes that points have at each node, regardless of pruning: those made by earlier nodes, and those
// that a Solve feeds back from the previous frame. A node that needs an attribute made only by later nodes fails when
// it is evaluated.
class AttributeFlow {
public:
    explicit AttributeFlow(const std::vector<PlannedNode>& nodes);

    // Returns true if the result of a node, given as an index into the plan's nodes, has an attribute that some node
    // makes.
    bool has(std::size_t node, std::string_view name) const;
    // Returns all attributes for which has() is true.
    std::vector<std::string> names_at(std::size_t node) const;

private:
    // One bit per made name, in the order of names_. Graphs of thousands of merged chains have one set per node.
    using Names = std::vector<std::uint64_t>;

    std::map<std::string, std::size_t, std::less<>> names_;
    std::vector<Names> at_;
};

// Throws Error, naming the node, if one name has two types, if a node uses an attribute or group that nothing makes
// (with the nearest name), or if only later nodes make the attribute.
void check_names(const std::vector<PlannedNode>& nodes, const AttributeFlow& flow, std::size_t simulation);

// Returns all attributes that are known or made, in order of name, with their users.
std::vector<PlannedAttribute> find_attributes(const std::vector<PlannedNode>& nodes, const AttributeFlow& flow,
                                              std::size_t simulation, const PlanOptions& options);

// Keeps each attribute of a merge result in every simulation whose points reach that merge. If the column were pruned
// there, these points would get the values of others.
void keep_for_merges(const std::vector<PlannedNode>& nodes, std::vector<PlannedSimulation>& simulations);

}  // namespace rapid
