// Explains a plan: each node, attribute and stage, with the plan's recorded reason to keep or prune it.
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
        std::string evaluated;  // "once", "every frame", "4 times per frame", "never"
        std::string why;        // why it is kept or pruned
        std::string changes;    // why it is evaluated every frame; empty otherwise
    };
    struct ExplainedAttribute {
        std::string name;        // a group's is group:NAME
        std::string simulation;  // its create's name
        bool kept;
        std::size_t bytes_per_point;  // 0 if pruned; a uniform column needs none
        std::string why;
        std::string brought_in_by;  // what would keep it; empty if it is kept
    };
    struct ExplainedFunction {
        std::string name;     // node and parameter: "pin1.target"
        std::string called;   // how often: "once per frame", "4 times per frame", "as often as its path needs"
        std::string between;  // its value between the calls, and its part in the estimated error
    };
    struct ExplainedStage {
        std::string name;
        bool kept;
        std::string why;
    };

    struct ExplainedCoupling {
        std::string name;  // of the node
        std::string what;  // "acts between neighbours"
    };

    // In order of creation, kept ones first.
    std::vector<ExplainedNode> nodes;
    // Kept ones first, by simulation and in order of name.
    std::vector<ExplainedAttribute> attributes;
    std::vector<ExplainedFunction> functions;  // parameters of kept nodes, in their order
    std::vector<ExplainedStage> stages;
    std::vector<std::vector<std::string>> passes;  // names of nodes
    // Reasons that no subset of the points can be simulated alone; empty if one can.
    std::vector<ExplainedCoupling> couplings;

    // The sum over all simulations.
    std::size_t bytes_per_point() const;
};

// Returns the usual way to make a pruned attribute live.
std::string usual_way_to_keep(const std::string& attribute);

// outputs: files that the run writes in addition to those of `:write` nodes, as named by the user.
Explanation explain(const Plan& plan, const std::vector<std::string>& outputs);

}  // namespace rapid
