// The graph of a plan as a picture: its nodes, the data between them, and the reasons for pruning some.
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
        std::string simulation;  // name of its create node; empty for pruned nodes
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

// Returns the graph for Graphviz: from left to right, with a dashed edge from each Solve to its Create. Without tips
// the text is the same for all values of parameters, and so is the layout.
enum class Tips { Kept, Pruned };
std::string to_dot(const GraphPicture& picture, Tips tips = Tips::Kept);

// Returns the picture as JSON. laid_out: the output of `dot -Tjson` for to_dot(), with the positions of nodes and the
// paths of edges in points (1/72 inch) from the upper left corner; empty: without positions.
std::string to_json(const GraphPicture& picture, const std::string& laid_out);

// Returns the output of `dot -T<format>` for a graph. Throws Error with the name of the package if dot is not on the
// PATH, or with dot's own message.
std::string lay_out(const std::string& graph, const std::string& format);

}  // namespace rapid
