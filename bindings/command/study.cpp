// rapid study: error against run time, of the scenes of a study file or of any graph by --sweep.
//
// This process only coordinates: the file is read, and each scene run, in a child process, so that a setting that
// crashes or never ends is only a failed row of the table.
#include <fmt/format.h>
#include <sys/stat.h>
#include <tbb/info.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "bindings/command/command.h"
#include "bindings/command/frame_selection.h"
#include "bindings/command/graph_options.h"
#include "bindings/command/machine.h"
#include "bindings/command/study_run.h"
#include "bindings/command/swept_setting.h"
#include "bindings/command/untrusted.h"
#include "runtime/files/whole_file.h"
#include "bindings/host/graph_parameter.h"
#include "runtime/printable.h"
#include "runtime/report/progress.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

int read_repeat(const std::string& text)
{
    constexpr std::int64_t most = 100000;
    const std::int64_t runs = read_whole("--repeat", text, 1);
    if (runs > most) throw Error(fmt::format("--repeat = {}; it must be at most {}", runs, most));
    return static_cast<int>(runs);
}

// One line on standard error: redrawn on a terminal, one a row elsewhere.
class StudyProgress {
public:
    StudyProgress(ProgressStyle style, std::size_t rows) : style_(style), rows_(rows) {}
    ~StudyProgress() { erase(); }

    void now(const std::string& what)
    {
        if (style_ != ProgressStyle::Bar) return;
        put(fmt::format("\r{}/{}  {}\x1b[K", done_, rows_, printable(what)));
        drawn_ = true;
    }
    void row(const std::string& label, const std::string& outcome)
    {
        ++done_;
        if (style_ == ProgressStyle::Lines)
            put(fmt::format("{}/{}  {}: {}\n", done_, rows_, printable(label), printable(outcome)));
    }

private:
    static void put(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stderr); }
    void erase()
    {
        if (drawn_) put("\r\x1b[K");
        drawn_ = false;
    }

    ProgressStyle style_;
    std::size_t rows_, done_ = 0;
    bool drawn_ = false;
};

// The result that a child told, or how it ended without one.
struct Outcome {
    json event;
    std::string failed;
    bool refused = false;
};

Outcome outcome_of(const std::function<void(const TellParent& tell)>& work,
                   const std::function<void(std::int64_t run)>& on_run = {})
{
    Outcome outcome;
    const std::string ending = run_in_child(work, [&](const json& event) {
        if (!event.contains("run"))
            outcome.event = event;
        else if (on_run)
            on_run(event.at("run"));
    });
    if (outcome.event.contains("failed")) {
        outcome.failed = outcome.event.at("failed");
        outcome.refused = outcome.event.at("refused");
    } else if (outcome.event.is_null()) {
        outcome.failed = "its process ended with " + (ending.empty() ? "no result" : ending);
    }
    return outcome;
}

class StudyCommand : public Command, public Confined {
public:
    std::string name() const override { return "study"; }
    std::string doc() const override { return "shows the error of a scene against its run time, at many settings"; }

    void declare(CLI::App& app) override
    {
        graph_.declare(app);
        const auto list = [&](const char* option, std::vector<std::string>& texts, const char* type, const char* doc) {
            app.add_option(option, texts, doc)->type_name(type)->allow_extra_args(false);
        };
        list("--sweep", sweep_, "NODE.PARAM=A,B,...",
             "of a graph: the values that a node's parameter takes; NODE is its name, or its type where one node has "
             "it");
        list("--reference", reference_, "VALUE",
             "of a graph: the value that is taken for right (of several swept parameters: NODE.PARAM=VALUE)");
        list("--lines", lines_, "NODE.PARAM", "of a graph: a swept parameter that tells the lines of the plot apart");
        app.add_option_function<std::string>(
               "-f,--frames", [this](const std::string& text) { frames_ = read_frames(text); },
               fmt::format("of a graph: the first frame and the last: 1-48 [default: {} from the first]",
                           default_frames))
            ->type_name("FRAMES");
        const Study defaults;
        app.add_option(
               "--error", error_,
               fmt::format("of a graph: rms, max or p95; or residual, of its constraints [default {}]", defaults.error))
            ->check(CLI::IsMember({"rms", "max", "p95", "residual"}))
            ->type_name("NORM");
        app.add_option("--error-frames", error_frames_, "of a graph: all but the first, or the last [default all]")
            ->check(CLI::IsMember({"all", "last"}))
            ->type_name("all|last");
        app.add_option_function<std::string>(
               "--repeat", [this](const std::string& text) { repeat_ = read_repeat(text); },
               fmt::format("timed runs of each row, of which the median is shown [default {}, or what the study says]",
                           defaults.repeat_runs))
            ->type_name("N");
        app.add_option("-o,--output", folder_, "where study.json and study.svg are written [default: here]")
            ->type_name("DIR");
        app.add_flag("--json", json_, "prints what study.json holds, in place of the table");
        app.add_flag("--quiet", quiet_, "no progress");
        untrusted_.declare(app, "graph");
    }

    // Each scene runs in a copy of this process.
    void confine(const CommonOptions& common) override
    {
        const auto access = [&] {
            open_folder();
            return SandboxAccess{{folder_of(graph_.file())}, {folder_}};
        };
        untrusted_.confine(access, common, Processes::Copies);
    }

    int run(const CommonOptions& common) override
    {
        const StudySource source{graph_.file(), !sweep_.empty(), graph_.session(), graph_.seed(), common.threads};
        const Study study = describe(source);
        open_folder();

        StudyResult result{
            study, {}, describe_machine(common.threads > 0 ? common.threads : tbb::info::default_concurrency())};
        {
            const std::vector<Knobs> rows = study.rows();
            StudyProgress progress(quiet_ ? ProgressStyle::None : progress_style(stderr), rows.size());
            for (const Knobs& knobs : rows) {
                StudyRow row = measure(source, study, knobs, progress);
                progress.row(study.label(knobs), row.failed.empty() ? fmt::format("error {:.3g}, {:.3f} ms", row.error,
                                                                                  1e3 * row.median_seconds())
                                                                    : "failed: " + row.failed);
                result.rows.push_back(std::move(row));
            }
        }
        const std::string text =
            to_json(result).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
        write_whole(fs::path(folder_) / "study.json", text);
        write_whole(fs::path(folder_) / "study.svg", to_svg(result));
        print(json_ ? text : to_text(result));
        return status_of(result);
    }

private:
    // The study of a graph that the options describe.
    Study asked() const
    {
        Study study;
        study.file = graph_.file();
        study.name = fs::path(graph_.file()).filename().string();
        for (const std::string& text : sweep_) {
            const auto [knob, values] = read_swept_setting("--sweep", text, "NODE.PARAM");
            if (study.sweep.count(knob)) throw Error(fmt::format("--sweep: {} is swept twice", knob));
            for (const std::string& value : values) study.sweep[knob].push_back(read_argument(value));
        }
        if (error_) study.error = *error_;
        if (!study.compares() && !reference_.empty())
            throw Error("--reference: a residual is compared with nothing; leave it out");
        if (study.compares() && reference_.empty())
            throw Error("--reference is missing; give the value that is taken for right, such as --reference 64");
        if (study.compares()) study.reference.emplace();
        for (const std::string& text : reference_) {
            if (study.sweep.size() == 1 && text.find('=') == std::string::npos) {
                (*study.reference)[study.sweep.begin()->first] = read_argument(text);
                continue;
            }
            const auto [knob, values] = read_swept_setting("--reference", text, "NODE.PARAM");
            if (values.size() != 1) throw Error(fmt::format("--reference \"{}\"; it must be one value", text));
            (*study.reference)[knob] = read_argument(values.front());
        }
        study.lines = lines_;
        study.last_frame_only = error_frames_ == "last";
        if (frames_) {
            if (frames_->step != 1) throw Error("-f: a study compares every frame; leave out the step");
            if (frames_->last == frames_->first) throw Error("-f: a study needs a first frame and a last: 1-48");
            study.first = frames_->first;
            study.last = frames_->last;
        } else {
            study.last = study.first + default_frames - 1;
        }
        study.complete();
        return study;
    }

    // Error: the file, the graph or the options are wrong; found before any scene is run.
    Study describe(const StudySource& source) const
    {
        if (!source.is_graph)
            for (const auto& [given, option] : {std::pair{!reference_.empty(), "--reference"},
                                                {!lines_.empty(), "--lines"},
                                                {frames_.has_value(), "-f"},
                                                {error_.has_value(), "--error"},
                                                {error_frames_.has_value(), "--error-frames"}})
                if (given) throw Error(fmt::format("{} goes with --sweep; a study file says it itself", option));
        const Study study = source.is_graph ? asked() : Study();
        const Outcome outcome =
            outcome_of([&](const TellParent& tell) { describe_study(source, study, !frames_.has_value(), tell); });
        if (!outcome.failed.empty()) throw Error(outcome.failed);
        Study described = read_study(outcome.event);
        if (repeat_) described.repeat_runs = *repeat_;
        return described;
    }

    // Error: it can't be written to; better found before the runs than after.
    void open_folder() const
    {
        std::error_code failure;
        fs::create_directories(folder_, failure);
        if (failure) throw Error(fmt::format("can't be made: {}", failure.message())).at({folder_, 0});
        if (access(folder_.c_str(), W_OK) != 0)
            throw Error(fmt::format("can't be written: {}", std::strerror(errno))).at({folder_, 0});
    }

    StudyRow measure(const StudySource& source, const Study& study, const Knobs& knobs, StudyProgress& progress)
    {
        StudyRow row;
        row.knobs = knobs;
        const auto fail = [&](const Outcome& outcome, const char* whose) {
            row.failed = whose + outcome.failed;
            row.refused = outcome.refused;
            return row;
        };
        const Reference& reference = reference_of(source, study, knobs, progress);
        if (!reference.outcome.failed.empty()) return fail(reference.outcome, "the reference: ");
        const std::string label = study.label(knobs);
        progress.now(label);
        const Outcome outcome = outcome_of(
            [&](const TellParent& tell) { run_row(source, study, knobs, reference.store, tell); },
            [&](std::int64_t run) { progress.now(fmt::format("{}  run {}/{}", label, run, study.repeat_runs + 1)); });
        if (!outcome.failed.empty()) return fail(outcome, "");
        read_row(outcome.event, row);
        return row;
    }

    struct Reference {
        std::string label;  // of its knobs; empty for a closed form, which needs no run
        PointStore store;
        Outcome outcome;
    };

    // Rows of one line share a reference, which is kept until another one is needed.
    const Reference& reference_of(const StudySource& source, const Study& study, const Knobs& knobs,
                                  StudyProgress& progress)
    {
        const Knobs wanted = study.reference ? study.reference_of(knobs) : Knobs();
        const std::string label = study.label(wanted);
        if (kept_ && kept_->label == label) return *kept_;
        kept_ = std::make_unique<Reference>();
        kept_->label = label;
        if (!study.reference) return *kept_;
        progress.now("reference: " + label);
        kept_->outcome =
            outcome_of([&](const TellParent& tell) { run_reference(source, study, wanted, kept_->store, tell); });
        return *kept_;
    }

    static int status_of(const StudyResult& result)
    {
        int status = status_done;
        for (const StudyRow& row : result.rows)
            if (!row.failed.empty()) status = std::max<int>(status, row.refused ? status_refused : status_failed);
        return status;
    }

    GraphOptions graph_;
    UntrustedOptions untrusted_;
    std::vector<std::string> sweep_, reference_, lines_;
    std::optional<FrameSelection> frames_;
    std::optional<std::string> error_, error_frames_;
    std::optional<int> repeat_;
    std::string folder_ = ".";
    bool json_ = false, quiet_ = false;
    std::unique_ptr<Reference> kept_;
};
RAPID_COMMAND(StudyCommand);

}  // namespace
}  // namespace rapid
