// Runs kernels between the nodes of a graph: as tests of points, and as edits.
#include <algorithm>
#include <optional>

#include "bindings/host/kernel.h"
#include "bindings/host/kernel_pass.h"
#include "bindings/host/script_host.h"
#include "runtime/base/first_error.h"
#include "runtime/points/members.h"

namespace rapid {

class Kernel::TestPass : public PointTest {
public:
    TestPass(const Kernel& kernel, const PointSet& points, const Evaluation& now)
        : kernel_(kernel),
          points_(points),
          caller_(now),
          section_(kernel.host_.watchdog, caller_.title()),
          layout_(kernel.layout_for(points, arguments_, true))
    {
    }

    void begin(bool of_all) override
    {
        layout_.settle(points_, !of_all);
        pass_.emplace(kernel_, points_, caller_, layout_, arguments_.values);
    }

    std::size_t chunk() const override { return kernel_.chunk_of(caller_, points_.size()); }

    void test(std::size_t begin, std::span<std::uint8_t> selected) const override
    {
        rapid_chunk chunk{};
        chunk.size = static_cast<std::int32_t>(selected.size());
        chunk.first = static_cast<double>(begin);
        chunk.members = layout_.masked ? selected.data() : nullptr;
        chunk.result = selected.data();
        pass_->run(chunk);
    }

private:
    const Kernel& kernel_;
    const PointSet& points_;
    const KernelCaller caller_;
    const Watchdog::Section section_;
    const KernelArguments arguments_;
    KernelLayout layout_;
    std::optional<KernelPass> pass_;
};

std::unique_ptr<PointTest> Kernel::test_of(const PointSet& points, const Evaluation& now) const
{
    return std::make_unique<TestPass>(*this, points, now);
}

void Kernel::edit(PointSet& points, std::size_t first, const Evaluation& now) const
{
    for (const std::string& name : analysis_.joins) points.group(name);
    if (first == points.size()) return;
    const KernelArguments none;
    KernelLayout layout = layout_for(points, none, false);
    layout.make_writable(points);
    layout.settle(points, false);
    const KernelCaller caller(now);
    const Watchdog::Section section(host_.watchdog, caller.title());
    const KernelPass pass(*this, points, caller, layout, none.values);

    const std::size_t size = points.size();
    std::vector<std::uint8_t> killed(kills() ? size : 0);
    FirstError error;
    for_each_chunk(
        size - first,
        [&](std::size_t begin, std::size_t end) {
            rapid_chunk chunk{};
            chunk.size = static_cast<std::int32_t>(end - begin);
            chunk.first = static_cast<double>(first + begin);
            chunk.kill = killed.empty() ? nullptr : killed.data() + first + begin;
            error.guard(0, begin, [&] { pass.run(chunk); });
        },
        chunk_of(caller, size - first));
    error.rethrow();
    if (std::find(killed.begin(), killed.end(), 1) == killed.end()) return;
    for (std::uint8_t& mark : killed) mark = !mark;
    points.keep(killed);
    now.figures.died += size - points.size();
}

class Kernel::Edit : public EditPass {
public:
    Edit(const Kernel& kernel, const PointSet& points, const std::string& group, const Evaluation& evaluation,
         const KernelArguments& arguments, const Before& before, KernelLayout layout)
        : EditPass(evaluation),
          kernel_(kernel),
          points_(points),
          group_(group),
          before_(before),
          caller_(evaluation),
          section_(kernel.host_.watchdog, caller_.title()),
          arguments_(arguments),
          layout_(std::move(layout))
    {
    }

    void begin() override
    {
        members_ = members_of(points_, group_);
        layout_.settle(points_, members_.stride != 0 || before_.removals);
        pass_.emplace(kernel_, points_, caller_, layout_, arguments_.values);
    }

    std::size_t chunk() const override { return kernel_.chunk_of(caller_, points_.size()); }
    bool is_script() const override { return true; }

    void visit(const Stretch& stretch) override
    {
        // This is a copy: a kernel may leave the group that chooses its points.
        std::vector<std::uint8_t> chosen;
        if (layout_.masked) chosen = stretch.choose(members_);
        std::vector<std::uint8_t> killed(kernel_.kills() ? stretch.size() : 0);
        rapid_chunk chunk{};
        chunk.size = static_cast<std::int32_t>(stretch.size());
        chunk.first = static_cast<double>(stretch.begin);
        chunk.members = chosen.empty() ? nullptr : chosen.data();
        chunk.kill = killed.empty() ? nullptr : killed.data();
        pass_->run(chunk);
        stretch.remove(killed);
    }

private:
    const Kernel& kernel_;
    const PointSet& points_;
    const std::string group_;
    const Before before_;
    const KernelCaller caller_;
    const Watchdog::Section section_;
    const KernelArguments arguments_;
    KernelLayout layout_;
    Strided<std::uint8_t> members_{nullptr, 0};
    std::optional<KernelPass> pass_;
};

std::unique_ptr<EditPass> Kernel::prepare(PointSet& points, const std::string& group, const Evaluation& now,
                                          const KernelArguments& arguments, const Before& before) const
{
    std::optional<KernelLayout> layout = make_writable(points, group, arguments);
    if (!layout) return nullptr;
    return std::make_unique<Edit>(*this, points, group, now, arguments, before, std::move(*layout));
}

}  // namespace rapid
