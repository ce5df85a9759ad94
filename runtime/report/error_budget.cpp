#include "runtime/report/error_budget.h"

#include <algorithm>

namespace rapid {

std::optional<ErrorBudget> error_budget_of(const FrameFigures& frame, const ErrorSources& sources)
{
    const std::optional<ErrorQuantiles>& error = frame.error.summary;
    const std::optional<ErrorQuantiles>& of_frame = frame.frame_error.summary;
    if (!error && !of_frame && frame.left_out_of_errors.empty()) return std::nullopt;

    ErrorBudget budget;
    budget.rounding = frame.rounding;
    budget.not_of_graph = sources.texts_of(UnmeasuredError::Graph);
    budget.not_of_shapes = sources.texts_of(UnmeasuredError::Shapes);
    for (const std::string& text : frame.left_out_of_errors)
        if (std::find(budget.not_of_graph.begin(), budget.not_of_graph.end(), text) == budget.not_of_graph.end())
            budget.not_of_solver.push_back(text);
    if (!error && budget.not_of_solver.empty()) budget.not_of_solver.push_back("the error since birth");

    const ErrorQuantiles found = error ? *error : of_frame.value_or(ErrorQuantiles());
    budget.is_exact = sources.is_closed_form && error && !(error->max > 0);
    const auto visible = [&](double value) { return budget.is_exact ? 0 : std::max(value, frame.rounding); };
    const ErrorQuantiles by_solver = {visible(found.p50), visible(found.p95), visible(found.max)};
    if (error && budget.not_of_solver.empty()) budget.solver = by_solver;
    budget.total = {by_solver.p50 + frame.rounding, by_solver.p95 + frame.rounding, by_solver.max + frame.rounding};
    budget.is_complete = budget.solver && budget.not_of_graph.empty() && budget.not_of_shapes.empty();
    return budget;
}

}  // namespace rapid
