// Requested files, and the parts of a scene's plan that they need.
#include "bindings/scene/run_outputs.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>

#include "bindings/host/kernel.h"
#include "bindings/run/races.h"
#include "bindings/scene/scene_impl.h"
#include "runtime/base/json.h"
#include "runtime/io/format.h"
#include "runtime/report/explanation_text.h"
#include "runtime/report/statistics.h"

namespace rapid {
namespace {

// The plan of a scene whose points go to files.
struct OutputPlan {
    FrameFiles files;
    Plan plan;

    OutputPlan(const SceneInside::Impl& scene, const FileOutputs& outputs, const PlanOptions& options)
        : files(frame_files(outputs)), plan(scene.session->graph(), options)
    {
        files.resolve(plan, true);
    }
};

PlanOptions plan_options(const SceneInside::Impl& scene, const FileOutputs& outputs)
{
    PlanOptions options = frame_files(outputs).plan_options(scene.options.seed);
    options.keep_all = scene.options.keep_all;
    return options;
}

// Without files, explains an output that names no attributes.
PlanOptions explained_options(const SceneInside::Impl& scene, const FileOutputs& outputs)
{
    PlanOptions options = plan_options(scene, outputs);
    if (outputs.outputs.empty()) options.all_made = true;
    return options;
}

Explanation explained(const SceneInside::Impl& scene, const FileOutputs& outputs)
{
    return rapid::explain(OutputPlan(scene, outputs, explained_options(scene, outputs)).plan, outputs.outputs);
}

// Reports by name the points of create nodes, and the data that nodes hold.
SceneReport report_of(const Snapshot& snapshot)
{
    std::map<std::string, std::size_t> simulations, nodes;
    std::vector<HeldBytes> kept;
    for (const auto& [name, state] : snapshot.simulations) {
        simulations[name] = state.size();
        kept.push_back({name, state.size(), "points, ids and adopted ids"});
    }
    for (const auto& [name, state] : snapshot.nodes) {
        nodes[name] = state.size();
        kept.push_back({name, state.size(), "of the node"});
    }
    JsonText json;
    json.begin_object();
    json.member("frame", snapshot.frame);
    if (!simulations.empty()) json.member("simulations", simulations);
    if (!nodes.empty()) json.member("nodes", nodes);
    json.end();
    return {to_text(fmt::format("\nSTATE after frame {}", snapshot.frame), kept), json.text()};
}

}  // namespace

void check_frames(const RunFrames& frames)
{
    constexpr std::int64_t least = std::numeric_limits<std::int32_t>::min();
    constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
    if (frames.step < 1 || frames.last < frames.first || frames.first < least || frames.last > most)
        refuse(fmt::format("frames {}-{}x{}: they must increase by a step of at least 1 and fit into 32 bits",
                           frames.first, frames.last, frames.step));
}

FrameFiles frame_files(const FileOutputs& files)
{
    constexpr int max_pixels = 16384;
    const PictureSettings& requested = files.pictures;
    if (std::min(requested.size.width, requested.size.height) < 1 ||
        std::max(requested.size.width, requested.size.height) > max_pixels)
        refuse(fmt::format("a picture of {}x{}: each side must be from 1 to {}", requested.size.width,
                           requested.size.height, max_pixels));
    return FrameFiles(files.outputs, picture_options(requested.camera, requested.size));
}

Result<OutputFormat> SceneInside::output_format(const std::string& output)
{
    try {
        const Format& format = format_of(parse_output_target(output).pattern);
        return OutputFormat{format.extension, format.film};
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

std::vector<OutputFormat> SceneInside::output_formats()
{
    std::vector<OutputFormat> all;
    for (const Format& format : formats()) all.push_back({format.extension, format.film});
    return all;
}

Result<std::vector<std::string>> SceneInside::output_folders(const FileOutputs& files)
{
    try {
        std::vector<std::string> folders;
        for (const std::filesystem::path& folder : folders_of(files.outputs)) folders.push_back(folder.string());
        return folders;
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

Result<SceneReport> SceneInside::explain_outputs(Scene& scene, const FileOutputs& files)
{
    SceneInside::Impl& impl = SceneInside::of(scene);
    return impl.call(SceneError::WrongScene, [&] {
        const Explanation explanation = explained(impl, files);
        return SceneReport{to_text(explanation), to_json(explanation)};
    });
}

Result<SceneReport> SceneInside::explain_difference(Scene& scene, const FileOutputs& files, Scene& other)
{
    SceneInside::Impl& here = SceneInside::of(scene);
    SceneInside::Impl& there = SceneInside::of(other);
    if (&here == &there) return wrong_call("the scene is compared with itself; open the file again");
    const Result<Explanation> own = here.call(SceneError::WrongScene, [&] { return explained(here, files); });
    if (!own) return own.error();
    const Result<Explanation> others = there.call(SceneError::WrongScene, [&] { return explained(there, files); });
    if (!others) return others.error();
    return here.call(SceneError::Unexpected, [&] {
        const Explanation more = surplus(*own, *others), less = surplus(*others, *own);
        const std::array bytes = {own->bytes_per_point(), others->bytes_per_point()};
        JsonText json;
        json.object("graph", here.file, "against", there.file, "only_graph", CheckedJson::parse(json_of_surplus(more)),
                    "only_against", CheckedJson::parse(json_of_surplus(less)), "bytes_per_point", bytes);
        return SceneReport{text_of_surplus(here.file, there.file, more) + '\n' +
                               text_of_surplus(there.file, here.file, less) +
                               fmt::format("\nbytes a point at most: {} and {}\n", bytes[0], bytes[1]),
                           json.text()};
    });
}

Result<SceneReport> SceneInside::explain_state(Scene& scene, const FileOutputs& files, std::int64_t frame)
{
    SceneInside::Impl& impl = SceneInside::of(scene);
    return impl.call(SceneError::FailedFrame, [&] {
        const SceneInside::Impl::Running running(impl);
        const OutputPlan output(impl, files, explained_options(impl, files));
        if (frame < output.plan.first_frame())
            refuse(fmt::format("frame {} is before the scene's first, {}", frame, output.plan.first_frame()));
        Evaluator evaluator(output.plan);
        impl.run_separately([&] {
            while (evaluator.next_frame() <= frame) evaluator.advance();
        });
        return report_of(evaluator.save());
    });
}

Result<std::string> SceneInside::check_outputs(Scene& scene, const FileOutputs& files)
{
    SceneInside::Impl& impl = SceneInside::of(scene);
    return impl.call(SceneError::WrongScene, [&] {
        const OutputPlan output(impl, files, plan_options(impl, files));
        std::string text;
        for (const Session::Parameter& parameter : impl.session->parameters()) {
            text += fmt::format("param {} = {}", parameter.name, describe(parameter.value));
            if (describe(parameter.value) != describe(parameter.fallback))
                text += fmt::format(" (default {})", describe(parameter.fallback));
            text += parameter.doc.empty() ? "\n" : fmt::format("  {}\n", parameter.doc);
        }
        std::vector<std::string> outputs;
        for (const auto& [name, place] : output.plan.outputs) outputs.push_back(name);
        text += fmt::format("{}: OK, {} of {} nodes lead to {} {}\n", impl.file, output.plan.nodes.size(),
                            impl.session->graph().nodes.size(), outputs.size() == 1 ? "output" : "outputs",
                            fmt::join(outputs, ", "));
        return text;
    });
}

namespace {

// Returns true if a kernel, which sees one point, raised the error: it would do so in the run, too. A function of all
// points may fail for lack of points, and a limit may be reached in the trial only.
bool is_of_kernel(const Plan& plan, const Error& error)
{
    if (error.kind() != ErrorKind::Fault) return false;
    return std::any_of(plan.nodes.begin(), plan.nodes.end(), [&](const PlannedNode& planned) {
        const auto& arguments = planned.node->arguments;
        return planned.node->name == error.node() &&
               std::any_of(arguments.begin(), arguments.end(), [](const auto& argument) {
                   const auto kernel = argument.second.template object<Kernel>();
                   return kernel && !kernel->source.of_the_set;
               });
    });
}

}  // namespace

Result<std::string> SceneInside::advice_on(Scene& scene, const FileOutputs& files)
{
    SceneInside::Impl& impl = SceneInside::of(scene);
    return impl.call(SceneError::FailedFrame, [&] {
        std::string text;
        std::optional<Error> raised;
        try {
            const SceneInside::Impl::Running running(impl);
            const OutputPlan output(impl, files, plan_options(impl, files));
            impl.run_separately([&] {
                try {
                    const Trial found = Evaluator(output.plan).examine();
                    text = advice(found.stiff) + text_of(found.resolution);
                } catch (const Error& error) {
                    if (!is_of_kernel(output.plan, error)) throw;
                    raised = error;
                }
            });
        } catch (const Error& error) {
            if (error.kind() == ErrorKind::Cancelled || error.kind() == ErrorKind::WrongCall) throw;
            if (!impl.evaluator) impl.start_again();  // without scripts that a limit has stopped
            impl.cancellation.forget();               // cancelled by a memory limit
        }
        if (raised) throw *raised;
        return text;
    });
}

Result<SceneRaces> SceneInside::find_races(Scene& scene, const FileOutputs& files, RunFrames frames)
{
    SceneInside::Impl& impl = SceneInside::of(scene);
    return impl.call(SceneError::FailedFrame, [&] {
        check_frames(frames);
        PlanOptions options = plan_options(impl, files);
        options.keep_all = true;  // an attribute that no file needs may show the race
        Races races;
        tbb::task_arena(1).execute([&] {
            // One interruption stops all sessions of the trials.
            const auto scripts = std::make_shared<Interruption>();
            const SceneInside::Impl::SeparateCall separate(impl, scripts);
            const auto load = [&](const KernelOrder& order) {
                SessionOptions session = impl.session_options(impl.settings);
                session.quiet = true;
                session.kernel_order = order;
                session.interruption = scripts;
                return std::make_unique<Session>(impl.file, std::move(session));
            };
            const std::unique_ptr<Session> in_order = load({});
            const Plan plan(in_order->graph(), options);
            frame_files(files).resolve(plan, true);
            if (frames.last < plan.first_frame())
                refuse(fmt::format("frame {} is before the scene's first, {}", frames.last, plan.first_frame()));
            races = races_in(load, plan, options, frames);
        });
        SceneRaces result;
        result.compared = races.compared;
        if (races.found) try {
                throw Error(*races.found);
            } catch (...) {
                result.found = caught_error(SceneError::FailedFrame);
            }
        return result;
    });
}

}  // namespace rapid
