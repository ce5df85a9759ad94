// A plan in words: each node, attribute and stage, whether it is kept, and why. The reasons are those that the plan has
// recorded.
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
        std::string why;        // why it is kept or left out
        std::string changes;    // why it is evaluated every frame; empty otherwise
    };
    struct ExplainedAttribute {
        std::string name;        // a group's is group:NAME
        std::string simulation;  // its create's name
        bool kept;
        std::size_t bytes_per_point;  // 0 where left out; a uniform column needs none
        std::string why;
        std::string brought_in_by;  // what would keep it; empty where it is kept
    };
    struct ExplainedStage {
        std::string name;
        bool kept;
        std::string why;
    };

    // In order of creation, kept ones first.
    std::vector<ExplainedNode> nodes;
    // Kept ones first, by simulation and in order of name.
    std::vector<ExplainedAttribute> attributes;
    std::vector<ExplainedStage> stages;
    std::vector<std::vector<std::string>> passes;  // names of nodes

    // The sum over all simulations.
    std::size_t bytes_per_point() const;
};

// What makes most attributes live that are left out.
std::string usual_way_in(const std::string& attribute);

// outputs: the files that the run writes besides those of `:write` nodes, as the user named them.
Explanation explain(const Plan& plan, const std::vector<std::string>& outputs);

}  // namespace rapid
