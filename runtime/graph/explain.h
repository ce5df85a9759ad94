// A plan in words: each node, attribute and stage, kept or left out, and why.
//
// The reasons are those that the plan has recorded; nothing is reckoned anew.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "runtime/graph/plan.h"

namespace rapid {

struct Explanation {
    struct ExplainedNode {
        std::string name, type;
        bool kept;
        std::string evaluated;  // "once", "every frame", "4 times a frame", "never"
        std::string why;        // it is kept or left out
        std::string changes;    // why it is evaluated every frame; empty for the others
    };
    struct ExplainedAttribute {
        std::string name;        // of a group as group:NAME
        std::string simulation;  // its create's name
        bool kept;
        std::size_t bytes_per_point;  // 0 where it is left out; where all points share one value it takes none
        std::string why;
        std::string brought_in_by;  // what would; empty for what is kept
    };
    struct ExplainedStage {
        std::string name;
        bool kept;
        std::string why;
    };

    // In the order in which they were made; kept ones first.
    std::vector<ExplainedNode> nodes;
    // By simulation; kept ones first, then in order of name.
    std::vector<ExplainedAttribute> attributes;
    std::vector<ExplainedStage> stages;
    std::vector<std::vector<std::string>> passes;  // names of nodes

    // Of the points of all simulations together, a point of each.
    std::size_t bytes_per_point() const;
};

// What brings in an attribute that is left out, of almost all of them.
std::string usual_way_in(const std::string& attribute);

// outputs: what the run writes besides its `:write` nodes, as the user named it.
Explanation explain(const Plan& plan, const std::vector<std::string>& outputs);

}  // namespace rapid
