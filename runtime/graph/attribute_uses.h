// Which attributes and groups the points of a simulation need, and who makes, writes and reads them: a liveness
// analysis over the nodes of a plan.
//
// An attribute is live where a node reads it, where an output asks for it, where a node writes it and so needs a
// column, or where its points are merged into a set that has it. An attribute that is only made is left out: no node
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

// Which attributes the points have at each node, whatever is pruned: what the nodes before it make, and what a Solve
// feeds back from the frame before. A node that needs one that only a later node makes fails when it is evaluated.

class AttributeFlow {
public:
    explicit AttributeFlow(const std::vector<PlannedNode>& nodes);

    // Whether the result of a node, an index into the plan's, has an attribute that some node makes.
    bool has(std::size_t node, std::string_view name) const;
    // All of these attributes.
    std::vector<std::string> names_at(std::size_t node) const;

private:
    // A bit for each name that is made, in the order of names_. Graphs of thousands of merged chains have one set a
    // node.
    using Names = std::vector<std::uint64_t>;

    std::map<std::string, std::size_t, std::less<>> names_;
    std::vector<Names> at_;
};

// Error: two types for one name; an attribute or group that a node uses and nothing makes, with the nearest name; an
// attribute that only later nodes make. Each names the node.
void check_names(const std::vector<PlannedNode>& nodes, const AttributeFlow& flow, std::size_t simulation);

// All attributes that are known or made, in order of name, with their users.
std::vector<PlannedAttribute> find_attributes(const std::vector<PlannedNode>& nodes, const AttributeFlow& flow,
                                              std::size_t simulation, const PlanOptions& options);

// Keeps an attribute that the result of a merge has in every simulation whose points reach that merge. A column that is
// pruned there would give these points the value of others.
void keep_for_merges(const std::vector<PlannedNode>& nodes, std::vector<PlannedSimulation>& simulations);

}  // namespace rapid
