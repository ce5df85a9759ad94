// A function of a point, written in Lua: the columns that it reads and writes, and its run over a set.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "bindings/host/kernel_analysis.h"
#include "bindings/host/kernel_layout.h"
#include "runtime/graph/point_edit.h"
#include "runtime/graph/point_function.h"

namespace rapid {

struct KernelCaller;
class ScriptHost;

// A Lua node's arguments for its kernel.
struct KernelArguments {
    std::map<std::string, Value> values;  // its third argument
    // Attributes and groups that the node names; the kernel uses them under computed names.
    std::set<std::string> reads, writes, joins;
};

class Kernel : public PointFunction {
public:
    Kernel(ScriptHost& host, KernelSource of) : source(std::move(of)), host_(host) {}

    // The type of a parameter that takes a function of all points.
    static constexpr std::string_view set_function_type = "function of the points";

    // Reads its bytecode, in the main state, once the file has run. Error: see analyse_kernel().
    void analyse();

    void uses(Uses& uses) const override;
    bool asks_places() const override { return analysis_.asks_places; }
    std::unique_ptr<PointTest> test_of(const PointSet& points, const Evaluation& now) const override;

    // As PointEdit's, for the points that are in `group` (all points if it is empty) when they are visited.
    std::unique_ptr<EditPass> prepare(PointSet& points, const std::string& group, const Evaluation& now,
                                      const KernelArguments& arguments, const Before& before) const;
    bool kills() const { return analysis_.kills; }

    // Its effect inside Solve, at every sub-step, on the points of `group`.
    std::shared_ptr<const Action> action(const std::string& group, const Evaluation& now,
                                         const KernelArguments& arguments) const;

    // With the names that its node declares.
    void uses(Uses& uses, const KernelArguments& arguments) const;
    // As an action, where `force` is that of the sub-step and no attribute.
    void uses_in_action(Uses& uses, const KernelArguments& arguments) const;

    ScriptHost& host() const { return host_; }
    // Whether it may read a field of this name of something.
    bool may_read(const std::string& name) const { return analysis_.may.count(name) > 0; }

    const KernelSource source;
    std::string fingerprint;  // the same in each state

private:
    class TestPass;
    class Edit;
    class ScriptAction;
    class ScriptActionPass;

    // Its names among the columns and groups of the set. To be settled.
    KernelLayout layout_for(const PointSet& points, const KernelArguments& arguments, bool predicate) const;
    // None where it has no point to visit.
    std::optional<KernelLayout> make_writable(PointSet& points, const std::string& group,
                                              const KernelArguments& arguments) const;
    // The number of points that go through it together.
    std::size_t chunk_of(const KernelCaller& caller, std::size_t size) const;

    ScriptHost& host_;
    KernelAnalysis analysis_;
};

}  // namespace rapid
