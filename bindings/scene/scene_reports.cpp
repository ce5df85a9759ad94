// Reports on a scene: its plan, its graph as a picture, and the lives of single points.
#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "bindings/scene/scene_impl.h"
#include "runtime/report/biography.h"
#include "runtime/report/explanation_text.h"
#include "runtime/report/graph_picture.h"

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

Result<std::string> SceneInside::graph_json(Scene& scene, GraphLayout* kept)
{
    Impl& impl = of(scene);
    return impl.call(SceneError::WrongCall, [&] {
        const GraphPicture picture = picture_of(*impl.plan);
        if (!kept) return to_json(picture, "");
        std::string dot = to_dot(picture, Tips::Pruned);
        if (kept->graph != dot) {
            std::string positions = lay_out(dot, "json");
            *kept = {std::move(dot), std::move(positions)};
        }
        return to_json(picture, kept->positions);
    });
}

SceneTrace Scene::Impl::trace(const TraceOptions& requested)
{
    Biographer(*plan, requested.ids, requested.create);  // throws Error if there is no such create
    if (requested.last < plan->first_frame())
        refuse(fmt::format("frame {} is before the scene's first, {}", requested.last, plan->first_frame()));
    start_again();  // only after the arguments are checked
    const Running running(*this);
    PlanOptions with_steps = plan_options();
    with_steps.keep_steps = true;
    const Plan traced(session->graph(), with_steps);
    Biographer biographer(traced, requested.ids, requested.create);
    Evaluator run(traced, {}, biographer.results());
    run.disable_error_estimates();
    biographer.watch(run);
    SceneTrace result;
    try {
        while (run.next_frame() <= requested.last) biographer.add(run.advance());
    } catch (const Error& error) {
        if (session->is_interrupted()) evaluator.reset();  // its scripts do not run again
        if (error.kind() == ErrorKind::Cancelled) throw;
        result.fault = caught_error(SceneError::FailedFrame);
        cancellation.forget();  // cancelled by a memory limit
    }
    session->take_warnings();  // of frames; the run reports them

    const std::int64_t first = std::max(requested.first, traced.first_frame());
    std::vector<Biography> lives = biographer.lives();
    for (const std::int64_t id : requested.ids)
        if (std::none_of(lives.begin(), lives.end(), [&](const Biography& life) { return life.id == id; }))
            result.unborn.push_back(id);
    for (Biography& life : lives)
        std::erase_if(life.steps, [&](const Biography::Step& step) {
            return step.frame < first || step.frame > requested.last || (step.frame - first) % requested.step != 0;
        });
    result.lives = {to_text(lives), to_json(lives)};
    return result;
}

Result<SceneTrace> Scene::trace(const TraceOptions& options)
{
    return impl_->call(SceneError::WrongCall, [&] {
        if (options.ids.empty()) refuse("there are no ids; give the ids of the points to report");
        if (options.last < options.first)
            refuse(fmt::format("frames {} to {} end before they begin", options.first, options.last));
        if (options.step < 1) refuse(fmt::format("step = {}; it must be at least 1", options.step));
        return impl_->trace(options);
    });
}

}  // namespace rapid
