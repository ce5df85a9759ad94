// Runs dot, Graphviz's program for laying out graphs.
#pragma once

#include <string>

namespace rapid {

// Returns the output of `dot -T<format>` for a graph. Throws Error with the name of the package if dot is not on the
// PATH, or with dot's own message.
std::string lay_out(const std::string& graph, const std::string& format);

}  // namespace rapid
