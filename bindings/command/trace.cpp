// rapid trace: the lives of single points.
#include <fmt/format.h>

#include <sstream>

#include "bindings/command/command.h"
#include "bindings/command/frame_selection.h"
#include "bindings/command/graph_options.h"
#include "bindings/command/memory_limit.h"
#include "bindings/command/untrusted.h"
#include "runtime/report/biography.h"
#include "runtime/threads.h"

namespace rapid {
namespace {

class Trace : public Command, public Confined {
public:
    std::string name() const override { return "trace"; }
    std::string doc() const override { return "tells the lives of single points"; }

    void declare(CLI::App& app) override
    {
        graph_.declare(app);
        app.add_option_function<std::string>(
               "--id",
               [this](const std::string& text) {
                   std::istringstream words(text);
                   for (std::string word; std::getline(words, word, ',');) ids_.push_back(read_whole("--id", word, 0));
               },
               "the points, by their ids: 17 or 17,40")
            ->type_name("N[,M...]")
            ->required();
        app.add_option("--of", create_, "the create whose points they are [default: every one]")->type_name("NAME");
        app.add_option_function<std::string>(
               "-f,--frames", [this](const std::string& text) { frames_ = read_frames(text); },
               fmt::format("the frames that are told; all before them are computed too [default: {} from the first]",
                           default_frames))
            ->type_name("FRAMES");
        app.add_flag("--json", json_, "as JSON");
        untrusted_.declare(app, "graph");
    }

    void confine(const CommonOptions& common) override
    {
        untrusted_.confine([&] { return SandboxAccess{{folder_of(graph_.file())}, {}}; }, common);
    }

    int run(const CommonOptions& common) override
    {
        Threads threads(common.threads);
        return threads.run([&] {
            const MemoryLimit limit(graph_.file(), end_at_limit(common));
            const std::unique_ptr<Session> session = graph_.load_to_look_at(common);
            PlanOptions options;
            options.seed = graph_.seed();
            options.keep_steps = true;
            const Plan plan(session->graph(), options);
            Biographer biographer(plan, ids_, create_);
            const std::int64_t start = plan.first_frame();
            const FrameSelection frames = frames_.value_or(FrameSelection{start, start + default_frames - 1});
            if (frames.last < start)
                throw Error(fmt::format("-f: frame {} is before the scene's first, {}", frames.last, start));
            Evaluator evaluator(plan, {}, biographer.results());
            evaluator.leave_out_errors();
            biographer.watch(evaluator);
            int status = status_done;
            try {
                while (evaluator.next_frame() <= frames.last) biographer.add(evaluator.advance());
            } catch (const Error& error) {
                print_error(error, common.verbose);
                status = status_failed;  // what is known until then is told
            }
            return tell(biographer.lives(), frames) ? status : std::max<int>(status, status_failed);
        });
    }

private:
    // Whether there was any.
    bool tell(std::vector<Biography> lives, const FrameSelection& frames) const
    {
        for (Biography& life : lives)
            std::erase_if(life.steps, [&](const Biography::Step& step) { return !frames.contains(step.frame); });
        for (const std::int64_t id : ids_)
            if (std::none_of(lives.begin(), lives.end(), [&](const Biography& life) { return life.id == id; }))
                print_warning(fmt::format("no point has the id {} up to frame {}", id, frames.last));
        print(json_ ? to_json(lives) + '\n' : to_text(lives));
        return !lives.empty();
    }

    GraphOptions graph_;
    std::vector<std::int64_t> ids_;
    std::string create_;
    std::optional<FrameSelection> frames_;
    UntrustedOptions untrusted_;
    bool json_ = false;
};
RAPID_COMMAND(Trace);

}  // namespace
}  // namespace rapid
