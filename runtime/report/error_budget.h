// The error of positions by source: what is estimated, and what is not (numerics.md, Sources of error).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/graph/error_sources.h"
#include "runtime/solver/figures.h"

namespace rapid {

struct ErrorBudget {
    std::optional<ErrorQuantiles> solver;  // m, since birth; nothing: not estimated
    bool is_exact = false;                 // the error of `solver` is known to be 0
    double rounding = 0;                   // m, of the point with the largest
    ErrorQuantiles total;                  // m, the sum of the sources that are estimated
    bool is_complete = false;              // all are
    // Why a source is not estimated; empty: it is. The graph and the shapes then have no error.
    std::vector<std::string> not_of_solver, not_of_graph, not_of_shapes;
};

// Returns nothing if no error was estimated in the frame. Step doubling shows no error below the rounding: a smaller
// estimate counts as the rounding, unless all motion has a closed form. A source that is not estimated adds nothing to
// the total. If the solver's error since birth is not estimated, the total has that of the frame.
std::optional<ErrorBudget> error_budget_of(const FrameFigures& frame, const ErrorSources& sources);

}  // namespace rapid
