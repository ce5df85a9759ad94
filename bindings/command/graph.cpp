// rapid graph: a picture of a scene's graph.
#include <fmt/format.h>

#include "bindings/command/command.h"
#include "bindings/command/graph_options.h"
#include "bindings/command/graphviz.h"
#include "bindings/command/memory_limit.h"
#include "bindings/command/untrusted.h"
#include "bindings/command/whole_file.h"
#include "runtime/report/graph_picture.h"
#include "runtime/threads.h"

namespace rapid {
namespace {

class GraphCommand : public Command, public Confined {
public:
    std::string name() const override { return "graph"; }
    std::string doc() const override { return "draws a graph: its nodes, from Create to Solve and back"; }

    void declare(CLI::App& app) override
    {
        graph_.declare(app);
        app.add_option("-o,--output", file_,
                       "the file: .svg, .dot (Graphviz's language) or .json (nodes, edges and their places) [default: "
                       ".dot to standard output]")
            ->type_name("FILE");
        untrusted_.declare(app, "graph");
    }

    void confine(const CommonOptions& common) override
    {
        SandboxAccess access{{folder_of(graph_.file())}, {}};
        if (!file_.empty()) access.writable.push_back(folder_of(file_));
        untrusted_.confine([&] { return access; }, common);
    }

    int run(const CommonOptions& common) override
    {
        const std::string extension = std::filesystem::path(file_).extension();
        if (!file_.empty() && extension != ".svg" && extension != ".dot" && extension != ".json")
            throw Error(fmt::format("-o {}: it must be a file of .svg, .dot or .json", file_));
        if (untrusted_.asked() && !file_.empty() && extension != ".dot")
            throw Error(fmt::format(
                "-o {}: dot, a program of its own, lays it out, which --untrusted forbids; write .dot", file_));
        Threads threads(common.threads);
        return threads.run([&] {
            const MemoryLimit limit(graph_.file(), end_at_limit(common));
            const std::unique_ptr<Session> session = graph_.load_to_look_at(common);
            PlanOptions options;
            options.seed = graph_.seed();
            const Plan plan(session->graph(), options);
            for (const std::string& warning : plan.warnings) print_warning(warning);
            const GraphPicture picture = picture_of(plan);
            const std::string dot = to_dot(picture);
            if (file_.empty())
                print(dot);
            else
                write_whole(file_, extension == ".svg"    ? lay_out(dot, "svg")
                                   : extension == ".json" ? to_json(picture, lay_out(dot, "json")) + '\n'
                                                          : dot);
            return status_done;
        });
    }

private:
    GraphOptions graph_;
    std::string file_;
    UntrustedOptions untrusted_;
};
RAPID_COMMAND(GraphCommand);

}  // namespace
}  // namespace rapid
