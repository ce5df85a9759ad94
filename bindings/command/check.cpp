// rapid check: finds all errors that can be found before the first frame, and stiff nodes, without running a frame;
// with --races, runs frames to find kernels that keep state from point to point.
#include <fmt/format.h>

#include "bindings/command/run_options.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/scene_inside.h"
#include "runtime/base/threads.h"

namespace rapid {
namespace {

class Check : public Command, public Confined {
public:
    std::string name() const override { return "check"; }
    std::string doc() const override { return "finds mistakes in a graph without running it"; }

    void declare(Options& options) override
    {
        graph_.declare(options);
        files_.declare(options);
        options.add_flag(
            "--races", races_,
            "runs frames with the points in other orders and in two Lua states, and compares the results bit by bit");
        options
            .add_option("-f,--frames", frames_text_,
                        "with --races: the frames that are compared, 24-26 [default: the two after the first]")
            .type_name("FIRST-LAST");
        untrusted_.declare(options, "graph");
    }

    void confine(const CommonOptions& common) override
    {
        untrusted_.confine([&] { return SandboxAccess{{folder_of(graph_.file())}, {}}; }, common);
    }

    int run(const CommonOptions& common) override
    {
        if (races_ && common.threads > 1)
            throw Error("--races visits the points in several orders on one thread; remove --threads");
        if (!races_ && !frames_text_.empty()) throw Error("-f chooses the frames of --races; give both, or neither");
        Threads threads(races_ ? 1 : common.threads);
        return threads.run([&] {
            Scene scene = graph_.open(common, SceneArguments::AtLimit::EndsProcess);
            const std::string text = SceneInside::check_outputs(scene, files_.files()).value();
            if (!races_) {
                print(text);
                print(SceneInside::advice_on(scene, files_.files()).value());
                return status_done;
            }
            const std::int64_t first = scene.first_frame();
            RunFrames frames{first + 1, first + 2};
            if (!frames_text_.empty()) frames = read_frames(frames_text_);
            if (frames.last < first)
                throw Error(fmt::format("-f {} ends before the scene begins, at frame {}", frames_text_, first));
            if (!is_free_of_races(scene, frames, common.verbose)) return status_failed;
            print(text +
                  fmt::format("frames {} to {}: bit-identical in every order of the points, and in two Lua states\n",
                              frames.first, frames.last));
            return status_done;
        });
    }

private:
    bool is_free_of_races(Scene& scene, const RunFrames& frames, bool verbose) const
    {
        const Result<SceneRaces> races = SceneInside::find_races(scene, files_.files(), frames);
        if (!races) {  // while a frame ran
            print_error(races.error(), verbose);
            return false;
        }
        if (races->found)
            print_error(*races->found, verbose);
        else if (!races->compared)
            print_warning(
                fmt::format("frames {} to {} have no points to compare; choose later frames, such as -f {}-{}",
                            frames.first, frames.last, frames.last + 22, frames.last + 24));
        return !races->found;
    }

    SceneArguments graph_;
    FileOptions files_;
    UntrustedOptions untrusted_;
    bool races_ = false;
    std::string frames_text_;
};
RAPID_COMMAND(Check);

}  // namespace
}  // namespace rapid
