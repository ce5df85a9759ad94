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

#include "bindings/command/machine.h"
#include "bindings/command/study_run.h"
#include "bindings/command/swept_setting.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/or_throw.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/untrusted.h"
#include "runtime/files/whole_file.h"
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
class RowProgress {
public:
    RowProgress(ProgressStyle style, std::size_t rows) : style_(style), rows_(rows) {}
    ~RowProgress() { erase(); }

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

    void declare(Options& options) override
    {
        graph_.declare(options);
        const auto list = [&](const char* option, std::vector<std::string>& texts, const char* type, const char* doc) {
            options.add_option(option, texts, doc).type_name(type).one_value();
        };
        list("--sweep", sweep_, "NODE.PARAM=A,B,...",
             "of a graph: the values that a node's parameter takes; NODE is its name, or its type where one node has "
             "it");
        list("--reference", reference_, "VALUE",
             "of a graph: the value that is taken for right (of several swept parameters: NODE.PARAM=VALUE)");
        list("--lines", lines_, "NODE.PARAM", "of a graph: a swept parameter that tells the lines of the plot apart");
        declare_frames(
            options, frames_,
            fmt::format("of a graph: the first frame and the last: 1-48 [default: {} from the first]", default_frames));
        const SceneStudy defaults;
        options
            .add_option("--error", error_,
                        fmt::format("of a graph: rms, max or p95; or residual, of its constraints [default {}]",
                                    defaults.error))
            .one_of({"rms", "max", "p95", "residual"})
            .type_name("NORM");
        options.add_option("--error-frames", error_frames_, "of a graph: all but the first, or the last [default all]")
            .one_of({"all", "last"})
            .type_name("all|last");
        options
            .add_option(
                "--repeat", [this](const std::string& text) { repeat_ = read_repeat(text); },
                fmt::format("timed runs of each row, of which the median is shown [default {}, or what the study says]",
                            defaults.repeat_runs))
            .type_name("N");
        options.add_option("-o,--output", folder_, "where study.json and study.svg are written [default: here]")
            .type_name("DIR");
        options.add_flag("--json", json_, "prints what study.json holds, in place of the table");
        options.add_flag("--quiet", quiet_, "no progress");
        untrusted_.declare(options, "graph");
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
        const StudyChild child{{graph_.file(), !sweep_.empty(), graph_.scene_options(), {}}, common.threads};
        const SceneStudy study = describe(child);
        open_folder();

        std::vector<StudyRun> rows;
        {
            const std::vector<StudyKnobs> all = or_throw(study.rows());
            RowProgress progress(quiet_ ? ProgressStyle::None : progress_style(stderr), all.size());
            for (const StudyKnobs& knobs : all) {
                StudyRun row = measure(child, study, knobs, progress);
                progress.row(study.label(knobs), row.failed.empty() ? fmt::format("error {:.3g}, {:.3f} ms", row.error,
                                                                                  1e3 * row.median_seconds())
                                                                    : "failed: " + row.failed);
                rows.push_back(std::move(row));
            }
        }
        const StudyReport report = or_throw(study.report(
            rows, describe_machine(common.threads > 0 ? common.threads : tbb::info::default_concurrency())));
        write_whole(fs::path(folder_) / "study.json", report.json + '\n');
        write_whole(fs::path(folder_) / "study.svg", report.svg);
        print(json_ ? report.json + '\n' : report.text);
        return status_;
    }

private:
    // The study of a graph that the options describe.
    SceneStudy asked() const
    {
        SceneStudy study;
        study.file = graph_.file();
        study.name = fs::path(graph_.file()).filename().string();
        for (const std::string& text : sweep_) {
            const auto [knob, values] = read_swept_setting("--sweep", text, "NODE.PARAM");
            if (study.sweep.count(knob)) throw Error(fmt::format("--sweep: {} is swept twice", knob));
            for (const std::string& value : values) study.sweep[knob].push_back(knob_value(value));
        }
        if (error_) study.error = *error_;
        if (!study.compares() && !reference_.empty())
            throw Error("--reference: a residual is compared with nothing; leave it out");
        if (study.compares() && reference_.empty())
            throw Error("--reference is missing; give the value that is taken for right, such as --reference 64");
        if (study.compares()) study.reference.emplace();
        for (const std::string& text : reference_) {
            if (study.sweep.size() == 1 && text.find('=') == std::string::npos) {
                (*study.reference)[study.sweep.begin()->first] = knob_value(text);
                continue;
            }
            const auto [knob, values] = read_swept_setting("--reference", text, "NODE.PARAM");
            if (values.size() != 1) throw Error(fmt::format("--reference \"{}\"; it must be one value", text));
            (*study.reference)[knob] = knob_value(values.front());
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
        or_throw(study.complete());
        return study;
    }

    // Error: the file, the graph or the options are wrong; found before any scene is run.
    SceneStudy describe(const StudyChild& child) const
    {
        if (!child.source.is_scene)
            for (const auto& [given, option] : {std::pair{!reference_.empty(), "--reference"},
                                                {!lines_.empty(), "--lines"},
                                                {frames_.has_value(), "-f"},
                                                {error_.has_value(), "--error"},
                                                {error_frames_.has_value(), "--error-frames"}})
                if (given) throw Error(fmt::format("{} goes with --sweep; a study file says it itself", option));
        const SceneStudy study = child.source.is_scene ? asked() : SceneStudy();
        const Outcome outcome =
            outcome_of([&](const TellParent& tell) { describe_study(child, study, !frames_.has_value(), tell); });
        if (!outcome.failed.empty()) throw Error(outcome.failed);
        SceneStudy described = read_study(outcome.event);
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

    StudyRun measure(const StudyChild& child, const SceneStudy& study, const StudyKnobs& knobs, RowProgress& progress)
    {
        const auto fail = [&](const Outcome& outcome, const char* whose) {
            status_ = std::max<int>(status_, outcome.refused ? status_refused : status_failed);
            StudyRun row;
            row.knobs = knobs;
            row.failed = whose + outcome.failed;
            return row;
        };
        const Reference& reference = reference_of(child, study, knobs, progress);
        if (!reference.outcome.failed.empty()) return fail(reference.outcome, "the reference: ");
        const std::string label = study.label(knobs);
        progress.now(label);
        const Outcome outcome = outcome_of(
            [&](const TellParent& tell) {
                run_row(child, study, knobs, reference.frames ? &*reference.frames : nullptr, tell);
            },
            [&](std::int64_t run) { progress.now(fmt::format("{}  run {}/{}", label, run, study.repeat_runs + 1)); });
        if (!outcome.failed.empty()) return fail(outcome, "");
        return read_row(outcome.event, knobs);
    }

    struct Reference {
        std::string label;                     // of its knobs
        std::optional<StudyReference> frames;  // nothing for a closed form, which needs no run
        Outcome outcome;
    };

    // Rows of one line share a reference, which is kept until another one is needed.
    const Reference& reference_of(const StudyChild& child, const SceneStudy& study, const StudyKnobs& knobs,
                                  RowProgress& progress)
    {
        const StudyKnobs wanted = study.reference ? study.reference_of(knobs) : StudyKnobs();
        const std::string label = study.label(wanted);
        if (kept_ && kept_->label == label) return *kept_;
        kept_.emplace().label = label;
        if (!study.reference) return *kept_;
        progress.now("reference: " + label);
        kept_->frames = or_throw(StudyReference::make());
        kept_->outcome =
            outcome_of([&](const TellParent& tell) { run_reference(child, study, wanted, *kept_->frames, tell); });
        return *kept_;
    }

    SceneArguments graph_;
    UntrustedOptions untrusted_;
    std::vector<std::string> sweep_, reference_, lines_;
    std::optional<FrameSelection> frames_;
    std::optional<std::string> error_, error_frames_;
    std::optional<int> repeat_;
    std::string folder_ = ".";
    bool json_ = false, quiet_ = false;
    std::optional<Reference> kept_;
    int status_ = status_done;
};
RAPID_COMMAND(StudyCommand);

}  // namespace
}  // namespace rapid
