// Graphviz's dot, a program of its own, which lays graphs out.
#pragma once

#include <string>

namespace rapid {

// What `dot -T<format>` makes of a graph in its language. Error: there is no dot on the PATH, with the package that has
// it; or what it says.
std::string lay_out(const std::string& graph, const std::string& format);

}  // namespace rapid
