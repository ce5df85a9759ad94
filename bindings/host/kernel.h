// A Lua function of a point: the columns that it reads and writes, and its run over a set.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bindings/host/kernel_analysis.h"
#include "bindings/host/state.h"
#include "runtime/graph/point_edit.h"
#include "runtime/graph/point_function.h"
#include "runtime/graph/step_shape.h"
#include "runtime/points/point_set.h"

namespace rapid {

// The columns and groups that a kernel sees in one pass, and the runner that a state makes for them.
struct KernelLayout {
    struct Entry {
        std::string name, type;
        bool writable;
        bool uniform = false;  // all points share one value
    };
    std::vector<Entry> columns, groups;
    bool predicate = false;  // the kernel's result is stored, and nothing may be written
    bool masked = false;     // it visits only some points of a chunk
    bool action = false;     // it runs inside Solve
    std::string key;         // equal for layouts that can share a runner

    // Makes the columns that the kernel writes writable.
    void make_writable(PointSet& points) const;

    // Completes the layout, when columns no longer move in memory.
    void settle(const PointSet& points, bool mask);

    // Turns a settled layout into that of an action: P and v are in double inside Solve, and the force is the
    // substep's.
    void settle_action(bool reads_force, bool writes_force);

private:
    void make_key();
};

// Returns the state's runner of a kernel for a layout. Makes it on first use.
State::Runner& runner_for(State& state, std::size_t kernel, const KernelLayout& layout);

struct KernelCaller;
class ScriptHost;

// A Lua node's arguments for its kernel.
struct KernelArguments {
    std::map<std::string, Value> values;  // its third argument
    // Attributes and groups that the node names; the kernel accesses them by computed names.
    std::set<std::string> reads, writes, joins;
};

class Kernel : public PointFunction, public PointEditor, public StepShapeUser, public AttributeLocations {
public:
    Kernel(ScriptHost& host, KernelSource of) : source(std::move(of)), host_(host) {}

    // Type of a parameter that takes a function of all points.
    static constexpr std::string_view set_function_type = "function of the points";

    // Reads its bytecode, in the main state, after the file has run. Throws like analyse_kernel().
    void analyse();

    void uses(Uses& uses) const override;
    bool reads_indices() const override { return analysis_.reads_indices; }
    std::optional<std::vector<ObjectPtr>> objects() const override { return objects_; }
    void edit(PointSet& points, std::size_t first, const Evaluation& now) const override;
    std::unique_ptr<PointTest> test_of(const PointSet& points, const Evaluation& now) const override;

    // Prepares a pass like PointEdit, over the points that are in `group` (all points if it is empty) when they are
    // visited.
    std::unique_ptr<EditPass> prepare(PointSet& points, const std::string& group, const Evaluation& now,
                                      const KernelArguments& arguments, const Before& before) const;
    bool kills() const { return analysis_.kills; }

    // Returns its action inside Solve, at every substep, on the points of `group`.
    std::shared_ptr<const Action> action(const std::string& group, const Evaluation& now,
                                         const KernelArguments& arguments) const;

    // Adds its uses, including the names that its node declares.
    void uses(Uses& uses, const KernelArguments& arguments) const;
    // Adds its uses as an action, in which `force` is the substep's force and not an attribute.
    void uses_in_action(Uses& uses, const KernelArguments& arguments) const;

    int numbers_of(const std::string& attribute) const override
    {
        const auto known = analysis_.vectors.find(attribute);
        return known == analysis_.vectors.end() ? 0 : known->second;
    }
    Location location_of(const std::string& attribute) const override
    {
        const auto found = analysis_.locations.find(attribute);
        return found == analysis_.locations.end() ? Location() : found->second;
    }

    // Returns true if it queries shapes that move or are meshes, found among the objects that it reaches.
    bool queries_moving_shapes() const override { return !moving_.empty(); }
    bool varies() const override { return queries_moving_shapes(); }
    void begin_step(const FrameClock& clock, const Frame& frame) const override;
    // Shapes as they are in this step.
    using StepShapes = std::vector<std::pair<const Object*, std::shared_ptr<const StepShape>>>;
    const StepShapes& step_shapes() const { return step_shapes_; }

    ScriptHost& host() const { return host_; }
    // Returns true if it may read a field of this name of any object.
    bool may_read(const std::string& name) const { return analysis_.may.count(name) > 0; }

    const KernelSource source;
    std::string fingerprint;  // the same in each state

private:
    class TestPass;
    class Edit;
    class ScriptAction;
    class ScriptActionPass;

    // Returns the columns and groups of the set that it names. The result still has to be settled.
    KernelLayout layout_for(const PointSet& points, const KernelArguments& arguments, bool predicate) const;
    // Returns nothing if no point is to be visited.
    std::optional<KernelLayout> make_writable(PointSet& points, const std::string& group,
                                              const KernelArguments& arguments) const;
    // Returns the number of points that it processes together.
    std::size_t chunk_of(const KernelCaller& caller, std::size_t size) const;

    ScriptHost& host_;
    KernelAnalysis analysis_;
    std::optional<std::vector<ObjectPtr>> objects_ = std::vector<ObjectPtr>();
    std::vector<ObjectPtr> moving_;   // the moving shapes and the meshes among them
    mutable StepShapes step_shapes_;  // written between passes, on one thread
};

}  // namespace rapid
