// rapid trace: shows the lives of single points.
#include <fmt/format.h>

#include <sstream>

#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/untrusted.h"
#include "runtime/base/threads.h"

namespace rapid {
namespace {

class Trace : public Command, public Confined {
public:
    std::string name() const override { return "trace"; }
    std::string doc() const override { return "reports the lives of single points"; }

    void declare(Options& options) override
    {
        graph_.declare(options);
        options
            .add_option(
                "--id",
                [this](const std::string& text) {
                    std::istringstream words(text);
                    for (std::string word; std::getline(words, word, ',');) ids_.push_back(read_whole("--id", word, 0));
                },
                "the ids of the points: 17 or 17,40")
            .type_name("N[,M...]")
            .required();
        options.add_option("--of", create_, "the create node of the points [default: all]").type_name("NAME");
        declare_frames(
            options, frames_,
            fmt::format("the frames to report; all frames before them are computed too [default: {} from the first]",
                        default_frames));
        options.add_flag("--json", json_, "as JSON");
        untrusted_.declare(options, "graph");
    }

    void confine(const CommonOptions& common) override
    {
        untrusted_.confine([&] { return SandboxAccess{{folder_of(graph_.file())}, {}}; }, common);
    }

    int run(const CommonOptions& common) override
    {
        Threads threads(common.threads);
        return threads.run([&] {
            Scene scene = graph_.open(common);
            const std::int64_t start = scene.first_frame();
            const RunFrames frames = frames_.value_or(RunFrames{start, start + default_frames - 1});
            if (frames.last < start)
                throw Error(fmt::format("-f: frame {} is before the scene's first, {}", frames.last, start));
            const SceneTrace trace = scene.trace({ids_, create_, frames.first, frames.last, frames.step}).value();
            if (trace.fault) print_error(*trace.fault, common.verbose);
            for (const std::int64_t id : trace.unborn)
                print_warning(fmt::format("no point up to frame {1} has the id {0}", id, frames.last));
            print(json_ ? trace.lives.json + '\n' : trace.lives.text);
            return trace.fault || trace.lives.text.empty() ? status_failed : status_done;
        });
    }

private:
    SceneArguments graph_;
    std::vector<std::int64_t> ids_;
    std::string create_;
    std::optional<RunFrames> frames_;
    UntrustedOptions untrusted_;
    bool json_ = false;
};
RAPID_COMMAND(Trace);

}  // namespace
}  // namespace rapid
