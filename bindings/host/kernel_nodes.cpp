// Nodes whose kernel is written in the scene: `:points`, `:action` and `:detail`.
#include <fmt/format.h>

#include <algorithm>

#include "bindings/host/detail.h"
#include "bindings/host/kernel.h"
#include "runtime/graph/registry.h"
#include "runtime/points/point_names.h"

namespace rapid {
namespace {

constexpr std::string_view reads_doc = "attributes that the kernel reads by computed names";
constexpr std::string_view writes_doc = "attributes that the kernel assigns by computed names";

// Returns the declared names, which a kernel computes and its bytecode does not show.
KernelArguments declared(const std::vector<std::string>& reads, const std::vector<std::string>& writes)
{
    KernelArguments arguments;
    arguments.reads.insert(reads.begin(), reads.end());
    arguments.writes.insert(writes.begin(), writes.end());
    return arguments;
}

void check_writable(const std::vector<std::string>& writes)
{
    for (const PointName& known : point_names)
        if (known.read_only && std::find(writes.begin(), writes.end(), known.name) != writes.end())
            throw Error(fmt::format("writes: {} is read-only", known.name));
}

// points: edits the points one by one with a Lua function.
struct Points {
    std::string group;
    std::shared_ptr<const Kernel> kernel;
    std::vector<std::string> reads, writes;

    static NodeType declare()
    {
        return node<Points>("points", "Runs a Lua function on each point, in parallel.")
            .param(&Points::kernel, "kernel", Value(), any_number(), "", "function of a point, function(p, frame)")
            .of_type(std::string(PointFunction::param_type))
            .required()
            .constant()
            .varies()
            .param(&Points::reads, "reads", Value(), any_number(), "", std::string(reads_doc))
            .constant()
            .param(&Points::writes, "writes", Value(), any_number(), "", std::string(writes_doc))
            .constant();
    }
    static std::unique_ptr<Operator> make() { return std::make_unique<PointEditOf<Points>>(); }
    void check() const { check_writable(writes); }
    void uses(Uses& uses) const { kernel->uses(uses, declared(reads, writes)); }
    bool removes_points() const { return kernel->kills(); }
    bool reads_indices() const { return kernel->reads_indices(); }
    std::unique_ptr<EditPass> prepare(PointSet& points, const Evaluation& now, const Before& before) const
    {
        return kernel->prepare(points, group, now, declared(reads, writes), before);
    }
};
RAPID_NODE(Points);

// action: does the same inside Solve, at every substep (paper §2.3).
struct ScriptAction {
    std::string group;
    std::shared_ptr<const Kernel> kernel;
    std::vector<std::string> reads, writes;

    static NodeType declare()
    {
        return node<ScriptAction>("action", "Runs a Lua function on each point inside Solve, in every substep.")
            .param(&ScriptAction::kernel, "kernel", Value(), any_number(), "", "function of a point, function(p, step)")
            .of_type(std::string(PointFunction::param_type))
            .required()
            .constant()
            .varies()
            .param(&ScriptAction::reads, "reads", Value(), any_number(), "", std::string(reads_doc))
            .constant()
            .param(&ScriptAction::writes, "writes", Value(), any_number(), "", std::string(writes_doc))
            .constant();
    }
    void check() const { check_writable(writes); }
    void uses(Uses& uses) const { kernel->uses_in_action(uses, declared(reads, writes)); }
    std::shared_ptr<const Action> dynamic(const Evaluation& now) const
    {
        return kernel->action(group, now, declared(reads, writes));
    }
};
RAPID_NODE(ScriptAction);

// detail: runs a function over the whole set once a frame.
struct Detail {
    std::shared_ptr<const Kernel> kernel;

    static NodeType declare()
    {
        return node<Detail>("detail", "Runs a Lua function over the whole set of points, once per frame.")
            .param(&Detail::kernel, "kernel", Value(), any_number(), "", "function of the set, function(points, frame)")
            .of_type(std::string(Kernel::set_function_type))
            .required()
            .constant()
            .varies();
    }
    void uses(Uses& uses) const { kernel->uses(uses); }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        run_detail(*kernel, inputs[0], now, {});
        return std::move(inputs[0]);
    }
};
RAPID_NODE(Detail);

}  // namespace
}  // namespace rapid
