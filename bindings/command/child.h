// Work in a child process, so that a piece that crashes, hangs in a script or ends its process is only one failure of
// many.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace rapid {

using TellParent = std::function<void(const nlohmann::json& event)>;

// Forks. The child does `work`, tells events and ends; this process hears each as it comes. Returns an empty text, or
// how the child ended abnormally: "signal 11 (Segmentation fault)", "status 1".
//
// This process must have no other threads (a child would inherit locks that are never freed), so sessions and the
// runtime, which start threads, belong in children. A child's standard output goes to standard error, so that output of
// scripts does not mix with the parent's results.
std::string run_in_child(const std::function<void(const TellParent& tell)>& work,
                         const std::function<void(const nlohmann::json& event)>& hear);

// Makes this process end when its parent does, however the parent ends.
void end_with_parent(int parent);

}  // namespace rapid
