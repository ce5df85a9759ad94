// Explanations of plans as text and as JSON.
#pragma once

#include <string>
#include <vector>

#include "runtime/graph/explain.h"

namespace rapid {

std::string to_text(const Explanation& plan);
std::string to_json(const Explanation& plan);  // an object, in one line

// Returns the part that `one` keeps and `other` does not. Nodes are compared by type, as names differ between scenes.
Explanation surplus(const Explanation& one, const Explanation& other);
std::string text_of_surplus(const std::string& file, const std::string& other, const Explanation& surplus);
std::string json_of_surplus(const Explanation& surplus);  // an object, in one line

// Bytes that nodes hold, under a heading.
struct HeldBytes {
    std::string name;
    std::size_t bytes;
    std::string what;
};
std::string to_text(const std::string& heading, const std::vector<HeldBytes>& all);

}  // namespace rapid
