#include "runtime/graph/script_edit.h"

#include <algorithm>
#include <vector>

#include "runtime/graph/first_error.h"
#include "runtime/parallel.h"
#include "runtime/stopwatch.h"

namespace rapid {

void go_over(std::span<const std::unique_ptr<ScriptPass>> passes, std::size_t size)
{
    if (passes.empty()) return;
    std::size_t chunk = 0;
    for (const std::unique_ptr<ScriptPass>& pass : passes) chunk = std::max(chunk, pass->chunk());
    FirstError first;
    for_each_chunk(
        size,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t k = 0; k < passes.size(); ++k)
                if (!first.guard(k, begin, [&] { passes[k]->visit(begin, end); })) return;
        },
        chunk);
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
    const auto for_each_edit = [&](const auto& f) {
        for (std::size_t k = 0; k < edits.size(); ++k) try {
                f(*edits[k], *now[k]);
            } catch (Error& error) {
                error.in_node(now[k]->node).at(now[k]->location);
                throw;
            }
    };
    for_each_edit([&](ScriptEdit& edit, const Evaluation& told) { edit.prepare(points, told); });
    for_each_edit([&](ScriptEdit& edit, const Evaluation& told) {
        if (auto pass = edit.begin(points, told)) passes.push_back(std::move(pass));
    });
    go_over(passes, points.size());
    now.front()->figures.script_seconds += stopwatch.seconds();
}

}  // namespace rapid
