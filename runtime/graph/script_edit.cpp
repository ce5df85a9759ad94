#include "runtime/graph/script_edit.h"

#include <vector>

#include "runtime/graph/first_error.h"
#include "runtime/parallel.h"
#include "runtime/stopwatch.h"

namespace rapid {

void go_over(std::span<const std::unique_ptr<ScriptPass>> passes, std::size_t size)
{
    if (passes.empty()) return;
    FirstError first;
    for_each_chunk(
        size,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t k = 0; k < passes.size(); ++k)
                if (!first.guard(k, begin, [&] { passes[k]->visit(begin, end); })) return;
        },
        passes.front()->chunk());
    first.rethrow();
    for (const std::unique_ptr<ScriptPass>& pass : passes) pass->finish();
}

Flow ScriptEdit::evaluate(std::span<Flow> inputs, const Evaluation& now)
{
    ScriptEdit* const self = this;
    const Evaluation* const told = &now;
    edit_together({&self, 1}, {&told, 1}, inputs[0].points);
    return std::move(inputs[0]);
}

void edit_together(std::span<ScriptEdit* const> edits, std::span<const Evaluation* const> now, PointSet& points)
{
    const Stopwatch stopwatch;
    std::vector<std::unique_ptr<ScriptPass>> passes;
    for (std::size_t k = 0; k < edits.size(); ++k) edits[k]->prepare(points, *now[k]);
    for (std::size_t k = 0; k < edits.size(); ++k)
        if (auto pass = edits[k]->begin(points, *now[k])) passes.push_back(std::move(pass));
    go_over(passes, points.size());
    now.front()->figures.script_seconds += stopwatch.seconds();
}

}  // namespace rapid
