// What is told of a scene: its plan, its graph as a picture, the points behind a node, and the lives of single points.
#include <fmt/format.h>

#include <algorithm>
#include <exception>

#include "bindings/scene/scene_impl.h"
#include "runtime/report/biography.h"
#include "runtime/report/explanation_text.h"
#include "runtime/report/graph_picture.h"
#include "runtime/report/graphviz.h"

namespace rapid {

Result<SceneReport> Scene::explain()
{
    return impl_->call(SceneError::WrongCall, [&] {
        const Explanation explanation = rapid::explain(*impl_->plan, {});
        return SceneReport{to_text(explanation), to_json(explanation)};
    });
}

Result<std::string> Scene::graph(GraphForm form)
{
    return impl_->call(SceneError::WrongCall, [&] {
        const GraphPicture picture = picture_of(*impl_->plan);
        std::string dot = to_dot(picture);
        switch (form) {
            case GraphForm::Dot:
                return dot;
            case GraphForm::Svg:
                return lay_out(dot, "svg");
            case GraphForm::Json:
                return to_json(picture, lay_out(dot, "json"));
        }
        refuse(fmt::format("the form is {}; it must be one of GraphForm", static_cast<int>(form)));
    });
}

Scene::Impl::Traced Scene::Impl::trace(const TraceOptions& asked)
{
    const Running running(*this);
    PlanOptions with_steps = plan_options();
    with_steps.keep_steps = true;
    const Plan traced(session->graph(), with_steps);
    Biographer biographer(traced, asked.ids, asked.create);
    if (asked.last < traced.first_frame())
        refuse(fmt::format("frame {} is before the scene's first, {}", asked.last, traced.first_frame()));
    Evaluator run(traced, {}, biographer.results());
    run.leave_out_errors();
    biographer.watch(run);
    Traced result;
    try {
        while (run.next_frame() <= asked.last) biographer.add(run.advance());
    } catch (const Error& error) {
        if (session->interrupted() != Interruption::None) evaluator.reset();  // its scripts do not run again
        if (error.message().find(Cancellation::text) != std::string::npos) throw;
        result.fault = std::current_exception();
        result.is_late = is_late.exchange(false);
        cancellation.forget();  // of a limit of memory
    }
    session->take_warnings();  // of frames, which the run tells

    const std::int64_t first = std::max(asked.first, traced.first_frame());
    std::vector<Biography> lives = biographer.lives();
    for (const std::int64_t id : asked.ids)
        if (std::none_of(lives.begin(), lives.end(), [&](const Biography& life) { return life.id == id; }))
            result.trace.unborn.push_back(id);
    for (Biography& life : lives)
        std::erase_if(life.steps, [&](const Biography::Step& step) {
            return step.frame < first || step.frame > asked.last || (step.frame - first) % asked.step != 0;
        });
    result.trace.lives = {to_text(lives), to_json(lives)};
    return result;
}

SceneFrame Scene::Impl::points_behind(const std::string& node, std::int64_t frame)
{
    const Running running(*this);
    const Plan watched(session->graph(), plan_options());
    const auto& nodes_of_plan = watched.nodes;
    const auto found = std::find_if(nodes_of_plan.begin(), nodes_of_plan.end(),
                                    [&](const PlannedNode& planned) { return planned.node->name == node; });
    if (found == nodes_of_plan.end()) {
        std::vector<std::string> names;
        for (const SceneNode& one : nodes) names.push_back(one.name);
        const bool is_left_out = std::find(names.begin(), names.end(), node) != names.end();
        refuse(is_left_out ? fmt::format("node \"{}\" is left out: no output comes from it", node)
                           : fmt::format("the scene has no node \"{}\"{}", node, did_you_mean(node, names)));
    }
    if (frame < watched.first_frame())
        refuse(fmt::format("frame {} is before the scene's first, {}", frame, watched.first_frame()));
    PointSet points;  // of a node whose result never changes, those of its only evaluation
    Evaluator run(watched, {}, [&](const Node& of, std::int64_t, const PointSet& result) {
        if (of.name == node) points = result;
    });
    run.leave_out_errors();
    beside([&] {
        while (run.next_frame() <= frame) run.advance();
    });
    const PlannedSimulation& simulation = watched.simulations[found->simulation];
    auto data = std::make_shared<SceneFrame::Data>();
    data->scene = this;
    data->result.frame = frame;
    data->result.outputs.emplace(node, std::move(points));
    data->result.fps.emplace(node, simulation.fps);
    data->result.time.emplace(node, static_cast<double>(frame - simulation.start) / simulation.fps);
    return SceneFrame(std::move(data), node);
}

Result<SceneFrame> Scene::points_behind(const std::string& node, std::int64_t frame)
{
    return impl_->call(SceneError::FailedFrame, [&] {
        impl_->start_again();
        return impl_->points_behind(node, frame);
    });
}

Result<SceneTrace> Scene::trace(const TraceOptions& options)
{
    Result<Impl::Traced> traced = impl_->call(SceneError::WrongCall, [&] {
        if (options.ids.empty()) refuse("there are no ids; give those of the points that are to be told of");
        if (options.step < 1) refuse(fmt::format("step = {}; it must be at least 1", options.step));
        impl_->start_again();
        return impl_->trace(options);
    });
    if (!traced) return traced.error();
    if (traced->fault) try {
            std::rethrow_exception(traced->fault);
        } catch (...) {
            traced->trace.fault = caught_error(traced->is_late ? SceneError::TooLong : SceneError::FailedFrame);
        }
    return std::move(traced->trace);
}

}  // namespace rapid
