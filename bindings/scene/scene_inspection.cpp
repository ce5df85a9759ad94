// Inspects a scene and its frames: attributes, arguments, the points after nodes, and the origin of points.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "bindings/scene/scene_impl.h"
#include "runtime/points/id_index.h"

namespace rapid {
namespace {

void refuse_before_first(const Plan& plan, std::int64_t frame)
{
    if (frame < plan.first_frame())
        refuse(fmt::format("frame {} is before the scene's first, {}", frame, plan.first_frame()));
}

// Returns the node of this name, of `all` that the scene makes.
const PlannedNode& planned_node(const Plan& plan, const std::string& name, const std::vector<SceneNode>& all)
{
    for (const PlannedNode& planned : plan.nodes)
        if (planned.node->name == name) return planned;
    std::vector<std::string> names;
    for (const SceneNode& one : all) names.push_back(one.name);
    const bool is_left_out = std::find(names.begin(), names.end(), name) != names.end();
    refuse(is_left_out ? fmt::format("node \"{}\" is pruned: it leads to no output", name)
                       : fmt::format("the scene has no node \"{}\"{}", name, did_you_mean(name, names)));
}

}  // namespace

Result<std::vector<SceneAttribute>> SceneInside::attributes(Scene& scene)
{
    Impl& impl = of(scene);
    return impl.call(SceneError::WrongCall, [&] {
        std::vector<SceneAttribute> all;
        for (const PlannedSimulation& simulation : impl.plan->simulations) {
            const std::string& create = simulation.create->name;
            std::set<std::string> diagnostics;  // Evaluator::add_per_point_diagnostics
            if (impl.hooks.per_point_diagnostics && simulation.solve) diagnostics = {"asleep", "substeps"};
            if (!diagnostics.empty() && impl.options.estimate_errors) diagnostics.insert("error");
            for (const PlannedAttribute& attribute : simulation.attributes)
                if (!diagnostics.contains(attribute.name))
                    all.push_back({attribute.name, create, attribute.kept, attribute.bytes_per_point()});
            for (const std::string& name : diagnostics) all.push_back({name, create, true, sizeof(float)});
        }
        return all;
    });
}

Result<std::map<std::string, std::map<std::string, std::string>>> SceneInside::arguments(Scene& scene,
                                                                                         std::int64_t frame)
{
    Impl& impl = of(scene);
    return impl.call(SceneError::FailedFrame, [&] {
        const Scene::Impl::Running running(impl);
        std::map<std::string, std::map<std::string, std::string>> all;
        for (const PlannedNode& planned : impl.plan->nodes) {
            const PlannedSimulation& simulation = impl.plan->simulations[planned.simulation];
            const Frame now =
                FrameClock{simulation.fps, simulation.start, simulation.subframes}.at(static_cast<double>(frame));
            for (const auto& [name, value] : planned.node->arguments) {
                const FrameFunction* function = value.function();
                all[planned.node->name][name] = describe(function ? function->call(now) : value);
            }
        }
        return all;
    });
}

void Scene::Impl::compute_separately(const Plan& separate, std::int64_t frame, const Snapshot* from,
                                     Evaluator::ResultHook results)
{
    const Running running(*this);
    refuse_before_first(separate, frame);
    Evaluator run(separate, {}, std::move(results));
    if (hooks.per_point_diagnostics) run.add_per_point_diagnostics();
    if (!hooks.per_point_diagnostics || !options.estimate_errors) run.disable_error_estimates();
    run_separately([&] {
        if (from) run.load(*from);
        while (run.next_frame() <= frame) run.advance();
    });
}

SceneFrame Scene::Impl::frame_after_node(const Plan& separate, const PlannedNode& planned, std::int64_t frame,
                                         PointSet points) const
{
    const std::string& node = planned.node->name;
    const PlannedSimulation& simulation = separate.simulations[planned.simulation];
    auto data = std::make_shared<SceneFrame::Data>();
    data->scene = number;
    data->result.frame = frame;
    data->result.outputs.emplace(node, std::move(points));
    data->result.fps.emplace(node, simulation.fps);
    data->result.time.emplace(node, static_cast<double>(frame - simulation.start) / simulation.fps);
    return SceneFrame(std::move(data), node);
}

SceneFrame Scene::Impl::points_after(const std::string& node, std::int64_t frame)
{
    planned_node(*plan, node, nodes);
    refuse_before_first(*plan, frame);
    start_again();  // only after the arguments are checked
    const Plan watched(session->graph(), plan_options());
    const PlannedNode& found = planned_node(watched, node, nodes);
    PointSet points;  // for a node whose result never changes, those of its only evaluation
    compute_separately(watched, frame, nullptr, [&](const Node& of, std::int64_t, const PointSet& result) {
        if (of.name == node) points = result;
    });
    return frame_after_node(watched, found, frame, std::move(points));
}

const std::map<std::string, SceneFrame>& Scene::Impl::points_after_nodes(std::int64_t frame, const SceneSnapshot* from)
{
    if (from) {
        refuse_unless_of_this_graph(*from);
        if (from->frame() >= frame)
            refuse(fmt::format("the snapshot is after frame {}; frame {} needs an earlier one", from->frame(), frame));
    }
    if (node_results_frame == frame) return node_results;
    const Plan watched(session->graph(), plan_options());
    std::map<std::string, PointSet> results;
    compute_separately(watched, frame, from ? &from->data_->snapshot : nullptr,
                       [&](const Node& node, std::int64_t at, const PointSet& points) {
                           if (at == frame) results[node.name] = points;
                       });
    node_results_frame.reset();
    node_results.clear();
    for (const PlannedNode& planned : watched.nodes)
        if (const auto found = results.find(planned.node->name); found != results.end())
            node_results.emplace(found->first, frame_after_node(watched, planned, frame, std::move(found->second)));
    node_results_frame = frame;
    return node_results;
}

PointOrigin Scene::Impl::origin(const SceneFrame& frame, std::int64_t id, const SceneSnapshot* from)
{
    const auto output = plan->outputs.find(frame.output_);
    if (output == plan->outputs.end())
        refuse(fmt::format("the frame has an output \"{}\" that the scene does not have", frame.output_));
    const PointSet& points = frame.data_->result.outputs.at(frame.output_);
    const std::uint32_t index = IdIndex(points.id())[id];
    if (index == IdIndex::none) refuse("the point is not in this frame");
    const PlannedNode& planned = plan->nodes[output->second];
    if (planned.carries.size() == 1) return {plan->simulations[planned.simulation].create->name, id};
    // The chains' own points with bitwise equal position and velocity.
    std::vector<PointOrigin> found;
    const std::map<std::string, SceneFrame>& results = points_after_nodes(frame.number(), from);
    for (const std::size_t s : planned.carries) {
        const PlannedSimulation& simulation = plan->simulations[s];
        const auto end = results.find(simulation.solve ? simulation.solve->name : simulation.create->name);
        if (end == results.end()) continue;
        const PointSet& chain = end->second.data_->result.outputs.at(end->first);
        const Strided<Vec3f> P = chain.P().read(), v = chain.v().read();
        for (std::size_t i = 0; i < chain.size(); ++i)
            if (P[i] == points.P()[index] && v[i] == points.v()[index])
                found.push_back({simulation.create->name, chain.id()[i]});
    }
    if (found.size() == 1) return found.front();
    refuse(found.empty() ? "the chain of the point is unknown, because nodes after its Solve have moved it"
                         : "several points have this position and velocity; choose another frame");
}

Result<SceneFrame> Scene::points_after(const std::string& node, std::int64_t frame)
{
    return impl_->call(SceneError::FailedFrame, [&] { return impl_->points_after(node, frame); });
}

Result<std::map<std::string, SceneFrame>> SceneInside::points_after_nodes(Scene& scene, std::int64_t frame,
                                                                          const std::optional<SceneSnapshot>& from)
{
    Impl& impl = of(scene);
    return impl.call(SceneError::FailedFrame, [&] { return impl.points_after_nodes(frame, from ? &*from : nullptr); });
}

Result<PointOrigin> SceneInside::origin(Scene& scene, const SceneFrame& frame, std::int64_t id,
                                        const std::optional<SceneSnapshot>& from)
{
    Impl& impl = of(scene);
    return impl.call(SceneError::FailedFrame, [&] { return impl.origin(frame, id, from ? &*from : nullptr); });
}

}  // namespace rapid
