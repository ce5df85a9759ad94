// rapid study: error against run time, of the scenes of a study file or of any graph by --sweep.
//
// This process only coordinates: the file is read, and each scene run, in a child process, so that a setting that
// crashes or never ends is only a failed row of the table.
#include <fmt/format.h>
#include <luajit.h>
#include <sys/stat.h>
#include <sys/utsname.h>
#include <tbb/info.h>
#include <tbb/version.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <new>
#include <thread>

#include "bindings/command/processes.h"
#include "bindings/command/run_options.h"
#include "bindings/command_line/command.h"
#include "bindings/command_line/frame_selection.h"
#include "bindings/command_line/scene_arguments.h"
#include "bindings/command_line/untrusted.h"
#include "bindings/host/graph_parameter.h"
#include "bindings/run/study_scene.h"
#include "runtime/base/json.h"
#include "runtime/base/printable.h"
#include "runtime/base/threads.h"
#include "runtime/files/input_file.h"
#include "runtime/report/progress.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using json = CheckedJson;

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

std::string processor()
{
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("model name"))
            if (const std::size_t at = line.find(": "); at != std::string::npos) return line.substr(at + 2);
    return "unknown";
}

// The machine and the versions on which run times depend.
std::vector<std::pair<std::string, std::string>> describe_machine(int threads)
{
    utsname system{};
    uname(&system);
    return {{"processor", processor()},
            {"processors", fmt::format("{}", std::thread::hardware_concurrency())},
            {"threads", fmt::format("{}", threads)},
            {"system", fmt::format("{} {} {}", system.sysname, system.release, system.machine)},
            {"rapid", RAPID_VERSION},
            {"compiler", __VERSION__},
            {"luajit", LUAJIT_VERSION},
            {"tbb", TBB_runtime_version()}};
}

// JSON of studies and rows, as it goes through the pipe between the processes.

json json_of(const Value& value)
{
    if (const bool* boolean = value.get<bool>()) return *boolean;
    if (const std::string* text = value.get<std::string>()) return *text;
    if (const Vec3d* vector = value.get<Vec3d>()) return {vector->x(), vector->y(), vector->z()};
    return *value.get<double>();
}

Value value_of(const json& value)
{
    if (value.is_boolean()) return Value(value.get<bool>());
    if (value.is_string()) return Value(value.get<std::string>());
    if (value.is_array()) return Value(Vec3d(value[0], value[1], value[2]));
    return Value(value.get<double>());
}

json json_of(const Study& study)
{
    json sweep = json::object(), reference;
    for (const auto& [knob, values] : study.sweep)
        for (const Value& value : values) sweep[knob].push_back(json_of(value));
    if (study.reference)
        for (const auto& [knob, value] : *study.reference) reference[knob] = json_of(value);
    return {{"file", study.file},
            {"name", study.name},
            {"sweep", sweep},
            {"lines", study.lines},
            {"frames", {study.first, study.last}},
            {"error", study.error},
            {"last_frame_only", study.last_frame_only},
            {"reference", reference},
            {"repeat_runs", study.repeat_runs}};
}

Study study_of(const json& fields)
{
    Study study;
    study.file = fields.at("file");
    study.name = fields.at("name");
    study.lines = fields.at("lines").get<std::vector<std::string>>();
    for (const auto& [knob, values] : fields.at("sweep").items())
        for (const json& value : values) study.sweep[knob].push_back(value_of(value));
    study.first = fields.at("frames")[0];
    study.last = fields.at("frames")[1];
    study.error = fields.at("error");
    study.last_frame_only = fields.at("last_frame_only");
    if (!fields.at("reference").is_null()) {
        study.reference.emplace();
        for (const auto& [knob, value] : fields.at("reference").items()) (*study.reference)[knob] = value_of(value);
    }
    study.repeat_runs = fields.at("repeat_runs");
    return study;
}

json json_of(const StudyRow& row)
{
    return {{"error", row.error},       {"rounding", row.rounding}, {"seconds", row.seconds},
            {"compared", row.compared}, {"missing", row.missing},   {"unmeasured", row.unmeasured}};
}

StudyRow row_of(const json& fields, const Knobs& knobs)
{
    return {knobs,
            fields.at("error"),
            fields.at("rounding"),
            fields.at("seconds").get<std::vector<double>>(),
            fields.at("compared"),
            fields.at("missing"),
            "",
            fields.at("unmeasured").get<std::vector<std::string>>()};
}

// The result of a child, or the reason why there is none.
struct Outcome {
    json result;
    std::string failed;
    bool refused = false;  // no frame was computed
};

// Opens a scene and computes its frames. `progress` is called with the number of completed runs, 0 before the first
// frame.
using ChildWork = std::function<json(const StudySource& source, const StudyScene::Progress& progress)>;

// Does the work in the child. Reports {"run": number of completed runs} to the parent after each run, and at the end
// {"result": ...} or {"failed": why, "refused": true if no frame was computed}.
void do_work(StudySource source, int threads, const ChildWork& work, const ReportToParent& report)
{
    bool started = false;
    const auto fail = [&](const std::string& why, bool refused) { report({{"failed", why}, {"refused", refused}}); };
    const auto end = [&](const std::string& message) {
        fail(message, false);
        _exit(status_done);
    };
    source.session.on_timeout = end;
    const auto progress = [&](int runs) {
        started = true;
        if (runs > 0) report({{"run", runs}});
    };
    Threads all(threads);
    try {
        all.run([&] {
            const MemoryLimit limit(source.file, end);
            report({{"result", work(source, progress)}});
        });
    } catch (const std::bad_alloc&) {
        fail("out of memory", !started);
    } catch (const std::exception& error) {
        fail(error.what(), !started);
    }
}

class StudyCommand : public Command, public Confined {
public:
    std::string name() const override { return "study"; }
    std::string doc() const override { return "measures the error of a scene against its run time at many settings"; }

    void declare(Options& options) override
    {
        graph_.declare(options);
        const auto list = [&](const char* option, std::vector<std::string>& strings, const char* type,
                              const char* doc) {
            options.add_option(option, strings, doc).type_name(type).one_value();
        };
        list("--sweep", sweep_, "NODE.PARAM=A,B,...",
             "for a graph: the values of a parameter; NODE is a node's name, or its type if only one node has it");
        list("--reference", reference_, "VALUE",
             "for a graph: the value to compare with (with several swept parameters: NODE.PARAM=VALUE)");
        list("--lines", lines_, "NODE.PARAM",
             "for a graph: a swept parameter with one line in the plot for each value");
        declare_frames(options, frames_,
                       fmt::format("for a graph: the first and the last frame: 1-48 [default: {} from the first]",
                                   default_frames));
        const Study defaults;
        options
            .add_option(
                "--error", error_,
                fmt::format(
                    "for a graph: rms, max or p95 of the positions, or residual of the constraints [default {}]",
                    defaults.error))
            .one_of({"rms", "max", "p95", "residual"})
            .type_name("NORM");
        options
            .add_option("--error-frames", error_frames_,
                        "for a graph: all frames but the first, or the last [default all]")
            .one_of({"all", "last"})
            .type_name("all|last");
        options
            .add_option(
                "--repeat", [this](const std::string& text) { repeat_ = read_repeat(text); },
                fmt::format("timed runs of each row; the median is shown [default {}, or as the study says]",
                            defaults.repeat_runs))
            .type_name("N");
        options.add_option("-o,--output", folder_, "folder for study.json and study.svg [default: the current one]")
            .type_name("DIR");
        options.add_flag("--json", json_, "prints study.json instead of the table");
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
        threads_ = common.threads;
        const Study study = describe();
        open_folder();

        StudyResult result{study, {}, {}};
        {
            const std::vector<Knobs> all = study.rows();
            RowProgress progress(quiet_ ? ProgressStyle::None : progress_style(stderr), all.size());
            for (const Knobs& knobs : all) {
                StudyRow row = measure(study, knobs, progress);
                progress.row(study.label(knobs), row.failed.empty() ? fmt::format("error {:.3g}, {:.3f} ms", row.error,
                                                                                  1e3 * row.median_seconds())
                                                                    : "failed: " + row.failed);
                result.rows.push_back(std::move(row));
            }
        }
        result.machine = describe_machine(threads_ > 0 ? threads_ : tbb::info::default_concurrency());
        const std::string text = to_json(result) + '\n';
        write_whole(fs::path(folder_) / "study.json", text);
        write_whole(fs::path(folder_) / "study.svg", to_svg(result));
        print(json_ ? text : to_text(result));
        return status_;
    }

private:
    // Returns the study of a graph that the options describe.
    Study requested() const
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
            throw Error("--reference: a residual needs no reference; remove it");
        if (study.compares() && reference_.empty())
            throw Error("--reference is missing; give the value to compare with, such as --reference 64");
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
            if (frames_->step != 1) throw Error("-f: a study compares every frame; remove the step");
            if (frames_->last == frames_->first)
                throw Error("-f: a study needs a first and a last frame, such as 1-48");
            study.first = frames_->first;
            study.last = frames_->last;
        } else {
            study.last = study.first + default_frames - 1;
        }
        study.complete();
        return study;
    }

    bool is_scene() const { return !sweep_.empty(); }

    Outcome in_child(const ChildWork& work, const std::function<void(int run)>& on_run = {}) const
    {
        StudySource source{graph_.file(), is_scene(), {}, graph_.seed()};
        source.session.set = graph_.settings();
        source.session.script_timeout = graph_.options().script_seconds;
        source.session.script_memory = graph_.options().script_memory;
        Outcome outcome;
        json last;
        const std::string ending =
            run_in_child([&](const ReportToParent& report) { do_work(std::move(source), threads_, work, report); },
                         [&](const json& event) {
                             if (!event.contains("run"))
                                 last = event;
                             else if (on_run)
                                 on_run(event.at("run"));
                         });
        if (last.contains("failed"))
            outcome = {{}, last.at("failed"), last.at("refused")};
        else if (last.is_null())
            outcome.failed = "its process ended with " + (ending.empty() ? "no result" : ending);
        else
            outcome.result = last.at("result");
        return outcome;
    }

    // Throws Error if the file, the graph or the options are wrong, before any scene is run.
    Study describe() const
    {
        if (!is_scene())
            for (const auto& [given, option] : {std::pair{!reference_.empty(), "--reference"},
                                                {!lines_.empty(), "--lines"},
                                                {frames_.has_value(), "-f"},
                                                {error_.has_value(), "--error"},
                                                {error_frames_.has_value(), "--error-frames"}})
                if (given) throw Error(fmt::format("{} needs --sweep; a study file contains it", option));
        const Study study = is_scene() ? requested() : Study();
        const Outcome outcome = in_child([&](const StudySource& source, const StudyScene::Progress&) -> json {
            if (!source.is_scene) return json_of(read_study(source));
            const std::int64_t first = StudyScene(study, source, study.rows().front()).first_frame();
            Study from_first = study;
            if (!frames_) {
                from_first.last += first - study.first;
                from_first.first = first;
            }
            return json_of(from_first);
        });
        if (!outcome.failed.empty()) throw Error(outcome.failed);
        Study described = study_of(outcome.result);
        if (repeat_) described.repeat_runs = *repeat_;
        return described;
    }

    // Throws Error if the folder cannot be written, which is better found before the runs than after.
    void open_folder() const
    {
        std::error_code failure;
        fs::create_directories(folder_, failure);
        if (failure) throw Error(fmt::format("can't be made: {}", failure.message())).at({folder_, 0});
        if (access(folder_.c_str(), W_OK) != 0)
            throw Error(fmt::format("can't be written: {}", std::strerror(errno))).at({folder_, 0});
    }

    StudyRow measure(const Study& study, const Knobs& knobs, RowProgress& progress)
    {
        const auto fail = [&](const Outcome& outcome, const char* whose) {
            status_ = std::max<int>(status_, outcome.refused ? status_refused : status_failed);
            StudyRow row;
            row.knobs = knobs;
            row.failed = whose + outcome.failed;
            return row;
        };
        const Reference& reference = reference_of(study, knobs, progress);
        if (!reference.outcome.failed.empty()) return fail(reference.outcome, "the reference: ");
        const std::string label = study.label(knobs);
        progress.now(label);
        const Outcome outcome = in_child(
            [&](const StudySource& source, const StudyScene::Progress& runs) {
                const RecordLog* frames = reference.frames ? &*reference.frames : nullptr;
                return json_of(StudyScene(study, source, knobs).measure(frames, runs));
            },
            [&](int run) { progress.now(fmt::format("{}  run {}/{}", label, run, study.repeat_runs + 1)); });
        return outcome.failed.empty() ? row_of(outcome.result, knobs) : fail(outcome, "");
    }

    struct Reference {
        std::string label;                // of its knobs
        std::optional<RecordLog> frames;  // nothing for a closed form, which needs no run
        Outcome outcome;
    };

    // Rows of one line share a reference, which is cached until another one is needed.
    const Reference& reference_of(const Study& study, const Knobs& knobs, RowProgress& progress)
    {
        const Knobs reference_knobs = study.reference ? study.reference_of(knobs) : Knobs();
        const std::string label = study.label(reference_knobs);
        if (kept_ && kept_->label == label) return *kept_;
        kept_.emplace().label = label;
        if (!study.reference) return *kept_;
        progress.now("reference: " + label);
        RecordLog& frames = kept_->frames.emplace(RecordLog::in_memory());
        kept_->outcome = in_child([&](const StudySource& source, const StudyScene::Progress& runs) {
            StudyScene(study, source, reference_knobs).keep_frames(frames, runs);
            return json();
        });
        return *kept_;
    }

    SceneArguments graph_;
    UntrustedOptions untrusted_;
    std::vector<std::string> sweep_, reference_, lines_;
    std::optional<RunFrames> frames_;
    std::optional<std::string> error_, error_frames_;
    std::optional<int> repeat_;
    std::string folder_ = ".";
    bool json_ = false, quiet_ = false;
    int threads_ = 0;
    std::optional<Reference> kept_;
    int status_ = status_done;
};
RAPID_COMMAND(StudyCommand);

}  // namespace
}  // namespace rapid
