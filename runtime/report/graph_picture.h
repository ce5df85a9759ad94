// The graph of a plan as a picture: its nodes, what flows between them, and why some are left out.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/plan.h"

namespace rapid {

struct GraphPicture {
    struct Node {
        std::string name, type, kind;  // kind: "source", "points", "dynamic", "merge", "solve"
        std::string file;              // where the graph file makes it
        int line = 0;
        std::string simulation;  // the name of its create; empty of what is left out
        bool kept = true;
        std::string evaluated, why, changes;                         // as in Explanation
        std::vector<std::pair<std::string, std::string>> arguments;  // as the graph file gives them
        std::vector<std::string> makes, reads, writes;               // attributes, and groups as group:NAME
    };
    struct Edge {
        enum class Kind { Flow, Source, Feedback };  // Source: points that are only read; Feedback: from frame to frame
        std::size_t from, to;                        // indices of nodes
        Kind kind = Kind::Flow;
    };

    std::vector<Node> nodes;  // those of the plan, in its order, then those that are left out
    std::vector<Edge> edges;
    std::map<std::string, std::size_t> outputs;  // node by name
};

GraphPicture picture_of(const Plan& plan);

// For Graphviz: from left to right, with a dashed edge from each Solve to its Create. Without tips the text is the same
// for all values of parameters, as the layout is.
enum class Tips { Kept, LeftOut };
std::string to_dot(const GraphPicture& picture, Tips tips = Tips::Kept);

// The picture as JSON; laid_out: what `dot -Tjson` makes of to_dot(), for the places of nodes and the paths of edges in
// points (1/72 inch) from the upper left corner; empty: without places.
std::string to_json(const GraphPicture& picture, const std::string& laid_out);

}  // namespace rapid
