#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/frame.h"
#include "runtime/math/random.h"
#include "runtime/points/point_set.h"
#include "runtime/points/range.h"
#include "runtime/solver/figures.h"

namespace rapid {

// The prefix of a group's name in lists of both attributes and groups, such as the header of a .csv file.
inline const std::string group_prefix = "group:";

// The context of a node's evaluation.
struct Evaluation {
    Frame frame;
    bool at_start = false;    // the first frame: the initial state, before any dynamics
    const std::string& node;  // name
    const Location& location;
    RandomKey random;       // of (seed, name)
    FrameFigures& figures;  // statistics of this frame
    // Each string is reported once per run: it contains no frame and no counts, which belong in the figures.
    std::vector<std::string>& warnings;
    // Writes a set to a file; empty if nothing may be written (check, explain, test).
    const std::function<void(const std::string& pattern, const PointSet& points)>& write;
    // Attributes and groups that the plan prunes from this simulation (PlannedAttribute); null: none.
    const std::set<std::string>* pruned = nullptr;
    // Ranges of the attributes that a node reads for Solve: those of its parameters, and known ones.
    std::vector<AttributeRange> ranges = {};
    // The node is between a Create and its Solve: the next frame starts with the points that this Solve leaves.
    bool is_fed_back = true;

    // Returns true if a node that makes this attribute or group should make it.
    bool keeps(const std::string& name) const { return !pruned || !pruned->count(name); }
    bool keeps_group(const std::string& name) const { return keeps(group_prefix + name); }
};

// Returns a force, action, collider, constraint or interaction D of the evaluated node.
template <class D, class... Arguments>
std::shared_ptr<D> dynamic_of(const Evaluation& now, const std::string& group, Arguments&&... arguments)
{
    auto made = std::make_shared<D>(std::forward<Arguments>(arguments)...);
    made->node = now.node;
    made->location = now.location;
    made->group = group;
    made->ranges = now.ranges;
    return made;
}

}  // namespace rapid
