// rapid graph: a picture of a scene's graph.
#include <fmt/format.h>

#include "bindings/command_line/command.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/untrusted.h"
#include "runtime/base/threads.h"
#include "runtime/files/input_file.h"

namespace rapid {
namespace {

class GraphCommand : public Command, public Confined {
public:
    std::string name() const override { return "graph"; }
    std::string doc() const override { return "draws the nodes of a graph and their connections"; }

    void declare(Options& options) override
    {
        graph_.declare(options);
        options
            .add_option("-o,--output", file_,
                        "the file: .svg, .dot (Graphviz's language) or .json (nodes, edges and their positions) "
                        "[default: .dot to standard output]")
            .type_name("FILE");
        untrusted_.declare(options, "graph");
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
            throw Error(fmt::format("-o {}: the file must be .svg, .dot or .json", file_));
        if (untrusted_.requested() && !file_.empty() && extension != ".dot")
            throw Error(fmt::format("-o {} needs the program dot, which --untrusted does not allow; write .dot instead",
                                    file_));
        Threads threads(common.threads);
        return threads.run([&] {
            Scene scene = graph_.open(common);
            const GraphForm form = extension == ".svg"    ? GraphForm::Svg
                                   : extension == ".json" ? GraphForm::Json
                                                          : GraphForm::Dot;
            const std::string text = scene.graph(form).value();
            if (file_.empty())
                print(text);
            else
                write_whole(file_, form == GraphForm::Json ? text + '\n' : text);
            return status_done;
        });
    }

private:
    SceneArguments graph_;
    std::string file_;
    UntrustedOptions untrusted_;
};
RAPID_COMMAND(GraphCommand);

}  // namespace
}  // namespace rapid
