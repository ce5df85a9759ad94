// rapid check: everything that can be wrong before the first frame, without running one.
#include <fmt/format.h>
#include <unistd.h>

#include "bindings/commands/command.h"
#include "bindings/commands/frame_files.h"
#include "bindings/commands/graph_options.h"
#include "bindings/threads.h"

namespace rapid {
namespace {

class Check : public Command {
public:
    std::string name() const override { return "check"; }
    std::string doc() const override { return "finds what is wrong with a graph, without running it"; }

    void declare(CLI::App& app) override
    {
        graph_.declare(app);
        files_.declare(app);
    }

    int run(const CommonOptions& common) override
    {
        Threads threads(common.threads);
        return threads.run([&] {
            const std::unique_ptr<Session> session = graph_.load(false, [&](const std::string& message) {
                print_error(Error(message), common.verbose);
                _exit(status_failed);
            });
            for (const std::string& warning : session->warnings()) print_warning(warning);
            const Plan plan(session->graph(), files_.plan_options(graph_.seed()));
            for (const std::string& warning : plan.warnings) print_warning(warning);
            files_.resolve(plan, true);
            print(text_of(*session, plan));
            return status_done;
        });
    }

private:
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
        return text + fmt::format("{}: OK, {} of {} nodes reached from {} {}\n", graph_.file(), plan.nodes.size(),
                                  session.graph().nodes.size(), outputs.size() == 1 ? "output" : "outputs",
                                  fmt::join(outputs, ", "));
    }

    GraphOptions graph_;
    FrameFiles files_;
};
RAPID_COMMAND(Check);

}  // namespace
}  // namespace rapid
