// solve: advances the points by one frame under everything upstream, lets them age and die, and feeds them back to
// Create for the next frame (paper §2.1).
//
//   solve/step_observers   a step, and its observers
//   solve/step_dynamics    the dynamics of a step
//   solve/aging            ages and deaths
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "runtime/graph/coupling.h"
#include "runtime/graph/node.h"
#include "runtime/graph/stateful.h"
#include "runtime/operators/solve/aging.h"
#include "runtime/operators/solve/step_dynamics.h"
#include "runtime/operators/solve/step_observers.h"
#include "runtime/solver/collision/collision_block.h"
#include "runtime/solver/constraints/contact_state.h"
#include "runtime/solver/interaction.h"

namespace rapid {
namespace {

// Far above the need of any scene, like substep_limit: a run with more would not end and would show no sign of it.
constexpr int max_iterations = 10000;

struct Solve {
    std::optional<int> substeps;
    int iterations, max_substeps;
    double sleep;
    std::optional<double> tolerance;
    std::string group;

    static NodeType declare()
    {
        return node<Solve>("solve", "Advances the points by one frame: forces, motion, collisions, constraints.")
            .kind(NodeKind::Solve)
            .stage(Stage::Integration)
            .stage(Stage::ErrorEstimate)
            .takes("force")
            .takes("mass")
            .takes("life")
            .takes("airresist")
            .takes("targetv")
            .param(
                &Solve::substeps, "substeps", Value(), between(1, substep_limit), "",
                "number of substeps per frame; the default is 1, or with :contact the number that the points need to "
                "hold each other, up to max_substeps")
            .param(&Solve::iterations, "iterations", 1.0, between(1, max_iterations), "",
                   "iterations of the constraints per substep")
            .param(&Solve::sleep, "sleep", 0.25, or_infinity(above(0)), "s",
                   "time at rest after which points with constraints sleep until something acts on them; math.huge for "
                   "never")
            .param(&Solve::tolerance, "tolerance", Value(), above(0), "m per frame",
                   "maximum error per frame; each point takes 1, 2, 4, ... substeps, as its estimated error needs")
            .param(&Solve::max_substeps, "max_substeps", 64.0, between(1, substep_limit), "",
                   "maximum number of substeps, with a tolerance or without substeps")
            .writes("P")
            .writes("v");
    }

    // The choice of steps depends on whether all points share these values: the frame is then one step.
    std::string couples(const Plan& plan, const PlannedNode& node) const
    {
        const PlannedSimulation& simulation = plan.simulations[node.simulation];
        const auto has_group = [&](std::size_t writer) {
            const auto& arguments = plan.nodes[writer].node->arguments;
            const auto given = arguments.find("group");
            return given != arguments.end() && !given->second.is_nil();
        };
        for (const char* name : {"airresist", "targetv", "force"}) {
            const PlannedAttribute* attribute = simulation.find(name);
            if (!attribute || !attribute->kept) continue;
            const std::vector<std::size_t>& writers = attribute->written_by;
            if (attribute->made_by.size() > 1 || std::any_of(writers.begin(), writers.end(), has_group))
                return fmt::format("takes other steps if all points have the same {}", name);
        }
        return {};
    }

    // The initial state, before any dynamics: upstream, only Create has run.
    Flow start(std::span<Flow> inputs, const Evaluation&)
    {
        Flow flow = std::move(inputs[0]);
        flow.dynamics.clear();
        flow.simulation->state = flow.points;
        observers_.start(flow);
        return flow;
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        Step step{std::move(inputs[0]), now, tolerance, max_substeps};
        Flow& flow = step.flow;
        if (!substeps || step.is_examined()) step.needed = step.needed_substeps(iterations);
        step.options = options_of(step);
        prepare(step, shapes_);
        if (flow.simulation->trial) {
            observers_.begin(step, flow.points);
            flow.simulation->state = flow.points;
            return std::move(flow);
        }
        {
            const PointSet entered = flow.points;
            kick(step, step.options.time - step.options.h);
            observers_.begin(step, entered);
        }
        step.done = step.advance(flow.points, step.run, step.options);
        if (!flow.dynamics.actions().empty()) require_in_range(step);  // because they write attributes
        {
            const PointSet moved = flow.points;
            kick(step, step.options.time);
            observers_.each([&](StepObserver& observer) { observer.end(step, moved); });
        }
        now.figures.died += age_points(flow.points, group, now.frame.dt, [&](std::span<const std::uint8_t> stays) {
            observers_.each([&](StepObserver& observer) { observer.before_removal(step, stays); });
        });
        // The state stores how long points have been still and what holds them; the output has no such columns. The
        // copy shares the other columns, which belong to the state alone once the flow has been used.
        flow.points.remove("dt");
        flow.dynamics.clear();
        flow.simulation->state = flow.points;
        flow.points.remove("still");
        StuckColumns::remove_from(flow.points);
        observers_.each([&](StepObserver& observer) { observer.annotate(flow.points); });
        return std::move(flow);
    }

    static std::unique_ptr<Operator> make() { return stateful<Solve>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(shapes_, observers_, loads_, sleep_records_);
    }

private:
    SolveOptions options_of(const Step& step)
    {
        const FrameClock clock = step.flow.simulation->clock();
        const Frame& frame = step.now.frame;
        SolveOptions options;
        options.substeps = substeps.value_or(std::min(step.needed, max_substeps));
        options.time = frame.time;
        options.h = frame.dt;
        options.frame = static_cast<std::int64_t>(std::ceil(frame.number));
        options.group = group;
        options.begins_frame = clock.is_whole(clock.step_at(frame) - 1);
        options.interacts = step.interacts() && options.substeps > 1;
        options.iterations = iterations;
        options.loads = &loads_;
        options.sleep = sleep;
        options.sleep_records = &sleep_records_;
        return options;
    }

    // Applies interactions at the ends of the step, unless they act in each substep. time: s since the start.
    static void kick(Step& step, double time)
    {
        if (!step.options.interacts) interact(step.flow.points, step.run, step.options, time);
    }

    ColliderShapes shapes_;
    StepObservers observers_;
    ShapeLoads loads_;            // of the previous frame, if points are coupled
    SleepRecords sleep_records_;  // of the previous frame
};
RAPID_NODE(Solve);
RAPID_COUPLING("solve", Solve);

}  // namespace
}  // namespace rapid
