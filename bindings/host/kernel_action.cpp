// Runs kernels inside Solve: actions, at every substep.
#include "bindings/host/kernel.h"
#include "bindings/host/kernel_pass.h"
#include "bindings/host/script_host.h"
#include "runtime/points/members.h"

namespace rapid {

class Kernel::ScriptActionPass : public ActionPass {
public:
    ScriptActionPass(const Kernel& kernel, PointSet& points, const KernelCaller& caller, KernelLayout layout,
                     const std::map<std::string, Value>& values, std::vector<std::uint8_t> chosen)
        : section_(kernel.host_.watchdog, caller.title()),
          layout_(std::move(layout)),
          chosen_(std::move(chosen)),
          pass_(kernel, points, caller, layout_, values)
    {
    }

    void act(const Chunk& chunk, std::span<Vec3d> force, std::span<std::uint8_t> dead) override
    {
        std::vector<void*> columns;
        for (std::size_t i = 0; i < layout_.columns.size(); ++i) {
            const KernelLayout::Entry& entry = layout_.columns[i];
            columns.push_back(entry.type != "vec3d" ? pass_.column(i, chunk.first)
                              : entry.name == "P"   ? chunk.P.data()
                              : entry.name == "v"   ? chunk.v.data()
                                                    : force.data());
        }
        rapid_chunk of_kernel{};
        of_kernel.size = static_cast<std::int32_t>(chunk.size());
        of_kernel.first = static_cast<double>(chunk.first);
        of_kernel.kill = dead.data();
        if (layout_.masked) of_kernel.members = const_cast<std::uint8_t*>(chosen_.data()) + chunk.first;
        of_kernel.substep = chunk.substep;
        of_kernel.times = chunk.time.data();
        of_kernel.steps = chunk.dt.data();
        pass_.run(of_kernel, std::move(columns));
    }

private:
    const Watchdog::Section section_;
    const KernelLayout layout_;
    const std::vector<std::uint8_t> chosen_;  // members of the action's group, if it is masked
    const KernelPass pass_;
};

class Kernel::ScriptAction : public Action {
public:
    ScriptAction(const Kernel& kernel, const Evaluation& now, KernelArguments arguments)
        : kernel_(kernel), caller_(now), arguments_(std::move(arguments))
    {
        node = now.node;
        location = now.location;
    }

    void prepare(PointSet& points) const override { kernel_.make_writable(points, group, arguments_); }

    std::unique_ptr<ActionPass> begin(PointSet& points) const override
    {
        const Strided<std::uint8_t> members = members_of(points, group);
        if (points.empty() || (members.stride == 0 && !members[0])) return nullptr;
        KernelLayout layout = kernel_.layout_for(points, arguments_, false);
        layout.settle(points, members.stride != 0);
        layout.settle_action(reads_force(), writes_force());
        // This is a copy: a kernel may leave the group that chooses its points, but acts on them for the whole step.
        std::vector<std::uint8_t> chosen;
        if (layout.masked) chosen.assign(members.data, members.data + points.size());
        return std::make_unique<ScriptActionPass>(kernel_, points, caller_, std::move(layout), arguments_.values,
                                                  std::move(chosen));
    }

private:
    bool reads_force() const
    {
        const KernelAnalysis& analysis = kernel_.analysis_;
        return analysis.reads.count("force") || analysis.may.count("force") || arguments_.reads.count("force");
    }
    bool writes_force() const
    {
        const KernelAnalysis& analysis = kernel_.analysis_;
        return analysis.writes.count("force") || analysis.may_write.count("force") || arguments_.writes.count("force");
    }

    const Kernel& kernel_;
    const KernelCaller caller_;
    const KernelArguments arguments_;
};

std::shared_ptr<const Action> Kernel::action(const std::string& group, const Evaluation& now,
                                             const KernelArguments& arguments) const
{
    auto action = std::make_shared<ScriptAction>(*this, now, arguments);
    action->group = group;
    return action;
}

}  // namespace rapid
