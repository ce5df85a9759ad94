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
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/node.h"
#include "runtime/graph/plan.h"
#include "runtime/points/point_set.h"

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

// The checked mode of the evaluator: a node finds poison in every column and group that it has not declared, and must
// leave them unchanged. An incomplete declaration then shows immediately, not only in a scene that prunes a column
// that the node needs. Gaffer checks the hashes of its nodes in the same way.
class UndeclaredColumns {
public:
    // Replaces everything that `declared` does not name: with NaN in float columns, with an unlikely number in others.
    // P, v, id and dt stay, and all columns stay if the node may read everything.
    UndeclaredColumns(PointSet& points, std::span<const Uses> declared);

    // Restores the values by id; newborn points keep the values that they were given. `points`: the node's result, in
    // the same order. Throws Error if a column was written, or if poison reached a declared one.
    void restore(PointSet& points) const;

private:
    Column<std::int64_t> ids_;
    std::map<std::string, AnyColumn> columns_;
    std::map<std::string, Column<std::uint8_t>> groups_;
};

}  // namespace rapid
