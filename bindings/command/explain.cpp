// rapid explain: which parts of a scene are kept or left out, and why; and which ones a scene needs over another one.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bindings/command/command.h"
#include "bindings/run/frame_files.h"
#include "bindings/command/frame_selection.h"
#include "bindings/command/graph_options.h"
#include "bindings/command/memory_limit.h"
#include "bindings/command/untrusted.h"
#include "runtime/graph/evaluate.h"
#include "runtime/report/explanation_text.h"
#include "runtime/threads.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

class Explain : public Command, public Confined {
public:
    std::string name() const override { return "explain"; }
    std::string doc() const override { return "tells what a graph's plan keeps and leaves out, and why"; }

    void declare(CLI::App& app) override
    {
        graph_.declare(app);
        files_.declare(app);
        app.add_option("--against", against_, "tells what one of two graphs needs and the other does not")
            ->type_name("GRAPH");
        app.add_option_function<std::string>(
               "--state", [this](const std::string& text) { state_after_ = read_frames(text).last; },
               "computes the frames up to this one, and tells what each node then keeps, as a snapshot holds it")
            ->type_name("FRAME");
        app.add_flag("--json", json_, "as JSON");
        untrusted_.declare(app, "graph");
    }

    void confine(const CommonOptions& common) override
    {
        SandboxAccess access{{folder_of(graph_.file())}, {}};
        if (!against_.empty()) access.readable.push_back(folder_of(against_));
        untrusted_.confine([&] { return access; }, common);
    }

    int run(const CommonOptions& common) override
    {
        Threads threads(common.threads);
        return threads.run([&] {
            const auto end = end_at_limit(common);
            const MemoryLimit limit(graph_.file(), end);
            const Explanation here = explained(*graph_.load(false, end));
            if (against_.empty()) {
                ordered_json json = ordered_json::parse(to_json(here));
                if (state_after_) json["state"] = state_;
                print(json_ ? json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + '\n'
                            : to_text(here) + text_of_state());
                return status_done;
            }
            const Explanation there = explained(*graph_.load_other(against_, end));
            const Explanation more = surplus(here, there), less = surplus(there, here);
            if (json_)
                print(ordered_json{{"graph", graph_.file()},
                                   {"against", against_},
                                   {"only_graph", ordered_json::parse(json_of_surplus(more))},
                                   {"only_against", ordered_json::parse(json_of_surplus(less))},
                                   {"bytes_per_point", {here.bytes_per_point(), there.bytes_per_point()}}}
                          .dump(2, ' ', false, ordered_json::error_handler_t::replace) +
                      '\n');
            else
                print(text_of_surplus(graph_.file(), against_, more) + '\n' +
                      text_of_surplus(against_, graph_.file(), less) +
                      fmt::format("\nbytes a point at most: {} and {}\n", here.bytes_per_point(),
                                  there.bytes_per_point()));
            return status_done;
        });
    }

private:
    Explanation explained(Session& session)
    {
        for (const std::string& warning : session.take_warnings()) print_warning(warning);
        PlanOptions options = files_.plan_options(graph_.seed());
        // Without -o: as an output that names no attributes.
        if (files_.names().empty()) options.all_made = true;
        const Plan plan(session.graph(), options);
        for (const std::string& warning : plan.warnings) print_warning(warning);
        files_.resolve(plan, true);
        Explanation explanation = explain(plan, files_.names());
        if (state_after_ && against_.empty()) find_state(plan);
        return explanation;
    }

    // Bytes by name: of the points of each Create, and of each node that keeps something.
    void find_state(const Plan& plan)
    {
        Evaluator evaluator(plan, [](auto&&...) {});
        if (*state_after_ < plan.first_frame())
            throw Error(
                fmt::format("--state {}: it is before the scene's first frame, {}", *state_after_, plan.first_frame()));
        while (evaluator.next_frame() <= *state_after_) evaluator.advance();
        const Snapshot snapshot = evaluator.save();
        state_ = {{"frame", snapshot.frame}};
        for (const auto& [name, state] : snapshot.simulations) state_["simulations"][name] = state.size();
        for (const auto& [name, state] : snapshot.nodes) state_["nodes"][name] = state.size();
    }

    std::string text_of_state() const
    {
        if (!state_after_) return {};
        std::vector<KeptBytes> kept;
        for (const char* of : {"simulations", "nodes"})
            if (state_.contains(of))
                for (const auto& [name, size] : state_.at(of).items())
                    kept.push_back(
                        {name, size.get<std::size_t>(),
                         of == std::string_view("nodes") ? "of the node" : "points, ids and what is adopted"});
        return to_text(fmt::format("\nSTATE after frame {}", *state_after_), kept);
    }

    GraphOptions graph_;
    FrameFiles files_;
    std::string against_;
    UntrustedOptions untrusted_;
    std::optional<std::int64_t> state_after_;  // a frame
    ordered_json state_;
    bool json_ = false;
};
RAPID_COMMAND(Explain);

}  // namespace
}  // namespace rapid
