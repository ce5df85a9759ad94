// rapid explain: shows which parts of a scene are kept or pruned, and why; and which ones a scene needs over another
// one.
#include <fmt/format.h>

#include "bindings/command/run_options.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/scene/scene_inside.h"
#include "runtime/base/json.h"
#include "runtime/base/threads.h"

namespace rapid {
namespace {

class Explain : public Command, public Confined {
public:
    std::string name() const override { return "explain"; }
    std::string doc() const override { return "shows what the plan of a graph keeps and prunes, and why"; }

    void declare(Options& options) override
    {
        graph_.declare(options);
        files_.declare(options);
        options.add_option("--against", against_, "shows what one of two graphs needs and the other does not")
            .type_name("GRAPH");
        options
            .add_option(
                "--state", [this](const std::string& text) { state_after_ = read_frame("--state", text); },
                "computes the frames up to this one, and shows the state of each node as a snapshot stores it")
            .type_name("FRAME");
        options.add_flag("--json", json_, "as JSON");
        untrusted_.declare(options, "graph");
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
            Scene scene = graph_.open(common, SceneArguments::AtLimit::EndsProcess);
            const SceneReport kept = SceneInside::explain_outputs(scene, files_.files()).value();
            if (!against_.empty()) {
                Scene other = graph_.open_other(against_, common);
                const SceneReport more = SceneInside::explain_difference(scene, files_.files(), other).value();
                print(json_ ? json_text(CheckedJson::parse(more.json), 2) + '\n' : more.text);
                return status_done;
            }
            std::optional<SceneReport> state;
            if (state_after_) {
                if (*state_after_ < scene.first_frame())
                    throw Error(fmt::format("--state {} is before the scene's first frame, {}", *state_after_,
                                            scene.first_frame()));
                state = SceneInside::explain_state(scene, files_.files(), *state_after_).value();
            }
            if (json_) {
                CheckedJson json = CheckedJson::parse(kept.json);
                if (state) json["state"] = CheckedJson::parse(state->json);
                print(json_text(json, 2) + '\n');
            } else {
                print(kept.text + (state ? state->text : ""));
            }
            return status_done;
        });
    }

private:
    SceneArguments graph_;
    FileOptions files_;
    std::string against_;
    UntrustedOptions untrusted_;
    std::optional<std::int64_t> state_after_;  // a frame
    bool json_ = false;
};
RAPID_COMMAND(Explain);

}  // namespace
}  // namespace rapid
