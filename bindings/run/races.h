// Finds kernels whose effect on a point depends on the points before it.
//
// Frames are computed three times on one thread: in the order of the points, from the last point to the first, and
// alternating between two Lua states. A kernel that depends only on its own point gives bit-identical results each
// time. State that it keeps between points without a trace in its bytecode (in a table, in a coroutine) shows at the
// first node after which two of the sets differ.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "bindings/host/session.h"
#include "include/rapid/run.h"
#include "runtime/graph/plan.h"

namespace rapid {

struct Races {
    std::optional<Error> found;  // the first difference, with the node, the attribute, the point and both values
    bool compared = false;       // true if these frames had a point
};

// plan: of a session in the order of the points, on one thread; load: returns another session of the same scene, in
// another order. frames: those that are compared; all earlier ones are computed. Throws the error of a frame.
using LoadInOrder = std::function<std::unique_ptr<Session>(const KernelOrder& order)>;
Races races_in(const LoadInOrder& load, const Plan& plan, const PlanOptions& options, const RunFrames& frames);

}  // namespace rapid
