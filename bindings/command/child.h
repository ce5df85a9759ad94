// A piece of work in a process of its own, so that one that crashes, hangs in a script or ends the process is one
// failure of many.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace rapid {

using TellParent = std::function<void(const nlohmann::json& event)>;

// Forks. The child does `work`, tells events and ends; this process hears each as it comes. Empty, or how the child
// ended where it did not end by itself: "signal 11 (Segmentation fault)", "status 1".
//
// This process must have no other threads (a child would inherit locks that nobody frees), so all that starts some,
// sessions and the runtime, belongs into children. A child's standard output is standard error: what a script prints
// does not get between the parent's results.
std::string run_in_child(const std::function<void(const TellParent& tell)>& work,
                         const std::function<void(const nlohmann::json& event)>& hear);

// This process ends with its parent, however that ends.
void end_with_parent(int parent);

}  // namespace rapid
