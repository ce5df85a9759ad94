// Finds kernels whose effect on a point depends on the points before it.
//
// Two frames are computed three times on one thread: in the order of the points, from the last point to the first, and
// in two states of Lua by turns. A kernel that depends on its own point alone gives the same bits each time. State that
// it keeps from point to point without a trace in its bytecode (in a table, in a coroutine) shows at the first node
// after which two of the sets differ.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "bindings/command/graph_options.h"
#include "runtime/graph/plan.h"

namespace rapid {

// The number of frames that are compared, after the first, at which the nodes before Solve do not run.
inline constexpr std::int64_t frames_compared = 2;

// plan: of a session in the order of the points, on one thread. Returns the first difference, with the node, the
// attribute, the point and both values. Error: one that a frame raises.
std::optional<Error> find_race(const GraphOptions& graph, const Plan& plan, const PlanOptions& options,
                               const std::function<void(const std::string& message)>& on_timeout);

}  // namespace rapid
