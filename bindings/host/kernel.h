// A function of a point, written in Lua: what it reads and writes, and how it runs over a set.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bindings/host/state.h"
#include "runtime/graph/point_edit.h"
#include "runtime/graph/point_function.h"

namespace rapid {

struct Caller;
class ScriptHost;

// What a Lua node's kernel is given besides the points.
struct KernelArguments {
    std::map<std::string, Value> values;  // its third argument
    // Attributes and groups that the node names; the kernel gets at them under computed names.
    std::set<std::string> reads, writes, joins;
};

class Kernel : public PointFunction {
public:
    // of_the_set: its first parameter is all points, not one (:detail).
    Kernel(ScriptHost& script_host, std::size_t number_, Location location_, bool of_the_set_)
        : number(number_), location(std::move(location_)), of_the_set(of_the_set_), host_(script_host)
    {
    }

    // The type of a parameter that takes a function of all points.
    static constexpr std::string_view set_function_type = "function of the points";

    void uses(Uses& uses) const override;
    bool asks_places() const override { return asks_places_; }
    std::unique_ptr<PointTest> test_of(const PointSet& points, const Evaluation& now) const override;

    // As PointEdit's, of the points of `group` (all when it is empty) as it is when they are visited.
    std::unique_ptr<EditPass> prepare(PointSet& points, const std::string& group, const Evaluation& now,
                                      const KernelArguments& arguments, const Before& before) const;
    bool kills() const { return kills_; }

    // What it does inside Solve, at every sub-step, on the points of `group`.
    std::shared_ptr<const Action> action(const std::string& group, const Evaluation& now,
                                         const KernelArguments& arguments) const;

    ScriptHost& host() const { return host_; }

    // With the names that its node declares.
    void uses(Uses& uses, const KernelArguments& arguments) const;
    // As an action, where `force` is that of the sub-step and no attribute.
    void uses_in_action(Uses& uses, const KernelArguments& arguments) const;

    const std::size_t number;  // in each state
    const Location location;   // of the function
    const bool of_the_set;
    std::string fingerprint;          // of its bytecode, the same in each state
    bool may_compute_groups = false;  // it belongs to a node whose parameters name groups

    // Reads its bytecode, in the main state, once the file has run. Error: it writes what other points share.
    void analyse();

private:
    struct Layout;
    struct Pass;
    struct Call;
    class KernelTest;
    class KernelPass;
    class KernelAction;
    class KernelActionPass;

    Layout layout_for(const PointSet& points, const KernelArguments& arguments, bool predicate) const;
    void make_layout_of_action(Layout& layout, const KernelArguments& arguments) const;
    std::optional<Layout> make_writable(PointSet& points, const std::string& group,
                                        const KernelArguments& arguments) const;
    std::size_t chunk_of(const Caller& caller, std::size_t size) const;
    void run_chunk(const Pass& pass, const rapid_chunk& chunk) const;
    void run_chunk(const Pass& pass, Call& call) const;
    static Call one_point(const Pass& pass, const Call& call, std::int32_t i);
    void call_runner(State& state, const Pass& pass, const Call& call) const;
    State::Runner& runner_for(State& state, const Layout& layout) const;

    ScriptHost& host_;

    std::set<std::string> reads_, writes_, may_, may_write_, joins_, asks_;
    bool kills_ = false, asks_any_ = false, asks_places_ = false;
};

}  // namespace rapid
