#include "runtime/graph/point_edit.h"

#include <algorithm>
#include <cstring>
#include <functional>

#include "runtime/base/at_node.h"
#include "runtime/base/first_error.h"
#include "runtime/base/stopwatch.h"
#include "runtime/points/buffer.h"
#include "runtime/points/members.h"

namespace rapid {

std::vector<std::uint8_t> Stretch::choose(Strided<std::uint8_t> members) const
{
    std::vector<std::uint8_t> chosen(size(), members[begin]);
    if (members.stride != 0) std::copy_n(members.data + begin, size(), chosen.begin());
    if (alive) std::transform(chosen.begin(), chosen.end(), alive, chosen.begin(), std::bit_and<>());
    return chosen;
}

void Stretch::remove(std::span<const std::uint8_t> marks) const
{
    std::transform(marks.begin(), marks.end(), alive, alive,
                   [](std::uint8_t mark, std::uint8_t here) -> std::uint8_t { return here & ~mark; });
}

void run_passes(std::span<const std::unique_ptr<EditPass>> passes, PointSet& points, bool remove)
{
    if (passes.empty() || points.empty()) return;
    std::size_t chunk = 0;
    for (const std::unique_ptr<EditPass>& pass : passes) {
        at_node(pass->now.node, pass->now.location, [&] { pass->begin(); });
        chunk = std::max(chunk, pass->chunk());
    }
    const Buffer marks(remove ? points.size() : 0);
    auto* const alive = remove ? static_cast<std::uint8_t*>(marks.data()) : nullptr;
    FirstError first;
    for_each_chunk(
        points.size(),
        [&](std::size_t begin, std::size_t end) {
            const Stretch stretch{begin, end, alive ? alive + begin : nullptr};
            if (alive) std::fill_n(stretch.alive, stretch.size(), std::uint8_t{1});
            for (std::size_t k = 0; k < passes.size(); ++k) {
                const auto visit = [&] {
                    at_node(passes[k]->now.node, passes[k]->now.location, [&] { passes[k]->visit(stretch); });
                };
                if (!first.guard(k, begin, visit)) return;
            }
        },
        chunk);
    first.rethrow();
    if (!remove) return;
    const std::size_t size = points.size();
    points.keep({alive, size});
    passes.front()->now.figures.died += size - points.size();
}

Flow PointEdit::evaluate(std::span<Flow> inputs, const Evaluation& now)
{
    const PointEdit* const self = this;
    const Evaluation* const evaluation = &now;
    edit_together({&self, 1}, {&evaluation, 1}, inputs[0].points);
    return std::move(inputs[0]);
}

void edit_together(std::span<const PointEdit* const> edits, std::span<const Evaluation* const> now, PointSet& points)
{
    const Stopwatch stopwatch;
    std::vector<std::unique_ptr<EditPass>> passes;
    Before before;
    for (std::size_t k = 0; k < edits.size(); ++k)
        at_node(now[k]->node, now[k]->location, [&] {
            auto pass = edits[k]->prepare(points, *now[k], before);
            if (!pass) return;
            passes.push_back(std::move(pass));
            before.edits = true;
            before.removals |= edits[k]->removes_points();
        });
    run_passes(passes, points, before.removals);
    if (std::any_of(passes.begin(), passes.end(), [](const auto& pass) { return pass->is_script(); }))
        now.front()->figures.seconds.script += stopwatch.seconds();
}

Selection::Selection(const PointSet& points, std::string group, const PointFunction* where, const Evaluation& now,
                     const Before& before)
    : points_(points), group_(std::move(group)), before_(before), test_(where ? where->test_of(points, now) : nullptr)
{
}

void Selection::begin()
{
    members_ = members_of(points_, group_);
    const bool all = members_.stride == 0 && members_[0] && !before_.removals;
    if (test_) test_->begin(all);
}

std::vector<std::uint8_t> Selection::of(const Stretch& stretch) const
{
    std::vector<std::uint8_t> selected = stretch.choose(members_);
    const bool any = std::memchr(selected.data(), 1, selected.size()) != nullptr;
    if (test_ && any) test_->test(stretch.begin, selected);
    return selected;
}

}  // namespace rapid
