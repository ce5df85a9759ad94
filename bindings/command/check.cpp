// rapid check: finds all errors that can be found before the first frame, and stiff nodes, without running a frame;
// with --races, runs frames to find kernels that keep state from point to point.
#include <fmt/format.h>

#include "bindings/command/command.h"
#include "bindings/run/frame_files.h"
#include "bindings/command/frame_selection.h"
#include "bindings/command/graph_options.h"
#include "bindings/command/memory_limit.h"
#include "bindings/run/races.h"
#include "bindings/command/untrusted.h"
#include "runtime/report/statistics.h"
#include "runtime/threads.h"

namespace rapid {
namespace {

class Check : public Command, public Confined {
public:
    std::string name() const override { return "check"; }
    std::string doc() const override { return "finds what is wrong with a graph, without running it"; }

    void declare(CLI::App& app) override
    {
        graph_.declare(app);
        files_.declare(app);
        app.add_flag("--races", races_,
                     "runs frames in other orders of the points and in two states, and compares the bits");
        app.add_option("-f,--frames", frames_text_,
                       "with --races: the frames that are compared, 24-26 [default: the two after the first]")
            ->type_name("FIRST-LAST");
        untrusted_.declare(app, "graph");
    }

    void confine(const CommonOptions& common) override
    {
        untrusted_.confine([&] { return SandboxAccess{{folder_of(graph_.file())}, {}}; }, common);
    }

    int run(const CommonOptions& common) override
    {
        if (races_ && common.threads > 1)
            throw Error("--races goes over the points in orders of its own, on one thread; leave --threads out");
        if (!races_ && !frames_text_.empty())
            throw Error("-f chooses the frames of --races; without it no frame is run: give both, or leave it out");
        Threads threads(races_ ? 1 : common.threads);
        return threads.run([&] {
            const auto end = end_at_limit(common);
            const MemoryLimit limit(graph_.file(), end);
            const std::unique_ptr<Session> session = graph_.load(false, end);
            for (const std::string& warning : session->take_warnings()) print_warning(warning);
            PlanOptions options = files_.plan_options(graph_.seed());
            options.keep_all = races_;  // an attribute that no file needs may show the race
            const Plan plan(session->graph(), options);
            for (const std::string& warning : plan.warnings) print_warning(warning);
            files_.resolve(plan, true);
            frames_ = {plan.first_frame() + 1, plan.first_frame() + 2};
            if (!frames_text_.empty()) frames_ = read_frames(frames_text_);
            if (races_ && frames_.last < plan.first_frame())
                throw Error(
                    fmt::format("-f {} ends before the scene begins, at frame {}", frames_text_, plan.first_frame()));
            if (races_ && !is_free_of_races(plan, options, end, common.verbose)) return status_failed;
            print(text_of(*session, plan));
            if (!races_) print(advice_on(plan));
            return status_done;
        });
    }

private:
    bool is_free_of_races(const Plan& plan, const PlanOptions& options,
                          const std::function<void(const std::string& message)>& on_timeout, bool verbose) const
    {
        try {
            const Races races = find_races(graph_, plan, options, frames_, on_timeout);
            if (races.found)
                print_error(*races.found, verbose);
            else if (!races.compared)
                print_warning(
                    fmt::format("there is no point in frames {} to {}, and nothing to compare; choose later "
                                "frames, as -f {}-{}",
                                frames_.first, frames_.last, frames_.last + 22, frames_.last + 24));
            return !races.found;
        } catch (const Error& error) {  // while a frame ran
            print_error(error, verbose);
            return false;
        }
    }

    // Tries out the first frame, with a sample of the points. Its errors are left to the run to report.
    static std::string advice_on(const Plan& plan)
    {
        try {
            const FrameFigures found = Evaluator(plan).examine();
            return advice(found.stiff) + rapid::text_of(found.resolution);
        } catch (const Error&) {
            return "";
        }
    }

    std::string text_of(const Session& session, const Plan& plan) const
    {
        std::string text;
        for (const Session::Parameter& parameter : session.parameters()) {
            text += fmt::format("param {} = {}", parameter.name, describe(parameter.value));
            if (describe(parameter.value) != describe(parameter.fallback))
                text += fmt::format(" (default {})", describe(parameter.fallback));
            text += parameter.doc.empty() ? "\n" : fmt::format("  {}\n", parameter.doc);
        }
        std::vector<std::string> outputs;
        for (const auto& [name, place] : plan.outputs) outputs.push_back(name);
        text += fmt::format("{}: OK, {} of {} nodes reached from {} {}\n", graph_.file(), plan.nodes.size(),
                            session.graph().nodes.size(), outputs.size() == 1 ? "output" : "outputs",
                            fmt::join(outputs, ", "));
        if (races_)
            text += fmt::format("frames {} to {}: the same bits in every order of the points, and in two states\n",
                                frames_.first, frames_.last);
        return text;
    }

    GraphOptions graph_;
    FrameFiles files_;
    UntrustedOptions untrusted_;
    bool races_ = false;
    std::string frames_text_;
    FrameSelection frames_{1, 1};
};
RAPID_COMMAND(Check);

}  // namespace
}  // namespace rapid
