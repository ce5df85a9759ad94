// Which attributes the points have at each node, whatever is pruned: what the nodes before it make, and what a Solve
// feeds back from the frame before. A node that needs one that only a later node makes fails when it is evaluated.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/graph/plan.h"

namespace rapid {

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

}  // namespace rapid
