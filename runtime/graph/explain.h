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
    struct ExplainedFunction {
        std::string name;     // of the node and the parameter: "pin1.target"
        std::string called;   // how often: "once a frame", "4 times a frame", "as its path needs"
        std::string between;  // what holds between the calls, and whether the estimated error has it
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
    std::vector<ExplainedFunction> functions;  // parameters of kept nodes, in the order of these
    std::vector<ExplainedStage> stages;
    std::vector<std::vector<std::string>> passes;  // names of nodes
    // Why no subset of the points can be simulated alone; none where one can.
    std::vector<ExplainedCoupling> couplings;

    // The sum over all simulations.
    std::size_t bytes_per_point() const;
};

// What makes most attributes live that are left out.
std::string usual_way_in(const std::string& attribute);

// outputs: the files that the run writes besides those of `:write` nodes, as the user named them.
Explanation explain(const Plan& plan, const std::vector<std::string>& outputs);

}  // namespace rapid
