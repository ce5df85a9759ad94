// Studies: their scenes, run and measured, and what the rows show.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "bindings/host/graph_parameter.h"
#include "bindings/run/study_scene.h"
#include "bindings/scene/scene_impl.h"
#include "include/rapid/study.h"
#include "runtime/graph/override.h"

namespace rapid {
namespace {

Value value_inside(const SceneValue& value)
{
    if (const auto* vector = std::get_if<std::array<double, 3>>(&value))
        return Value(Vec3d((*vector)[0], (*vector)[1], (*vector)[2]));
    if (const auto* number = std::get_if<double>(&value)) return Value(*number);
    if (const auto* boolean = std::get_if<bool>(&value)) return Value(*boolean);
    return Value(std::get<std::string>(value));
}

Knobs knobs_inside(const StudyKnobs& knobs)
{
    Knobs result;
    for (const auto& [knob, value] : knobs) result[knob] = value_inside(value);
    return result;
}

StudyKnobs knobs_in_header(const Knobs& knobs)
{
    StudyKnobs result;
    for (const auto& [knob, value] : knobs) result[knob] = value_in_header(value);
    return result;
}

Study study_inside(const SceneStudy& study)
{
    Study result;
    result.file = study.file;
    result.name = study.name;
    for (const auto& [knob, values] : study.sweep)
        for (const SceneValue& value : values) result.sweep[knob].push_back(value_inside(value));
    result.lines = study.lines;
    result.first = study.first;
    result.last = study.last;
    result.error = study.error;
    result.last_frame_only = study.last_frame_only;
    if (study.reference) result.reference = knobs_inside(*study.reference);
    result.repeat_runs = study.repeat_runs;
    return result;
}

SceneStudy study_in_header(const Study& study)
{
    SceneStudy result;
    result.file = study.file;
    result.name = study.name;
    for (const auto& [knob, values] : study.sweep)
        for (const Value& value : values) result.sweep[knob].push_back(value_in_header(value));
    result.lines = study.lines;
    result.first = study.first;
    result.last = study.last;
    result.error = study.error;
    result.last_frame_only = study.last_frame_only;
    if (study.reference) result.reference = knobs_in_header(*study.reference);
    result.repeat_runs = study.repeat_runs;
    return result;
}

// What f(session, graph) gives, of the scene of these knobs. A study file has no graph without knobs. is_started:
// whether its first frame was due.
template <class F>
auto with_scene(const StudySource& source, const Knobs& knobs, const bool& is_started, const F& f)
    -> Result<decltype(f(std::declval<const Session&>(), std::declval<Graph>()))>
{
    if (source.file.empty()) return wrong_call("no file is named; give the path of a study or of a scene");
    if (std::optional<SceneError> fault = fault_of(source.options)) return std::move(*fault);
    try {
        SceneInside::Impl impl;
        impl.file = source.file;
        impl.options = source.options;
        impl.hooks = source.hooks;
        impl.hooks.keep_state = impl.hooks.tell_points = false;
        if (impl.options.threads > 0) impl.arena.emplace(impl.options.threads);
        auto result = impl.call(SceneError::WrongScene, [&] {
            impl.take_offers();
            std::map<std::string, std::string> set;
            for (const auto& [name, value] : impl.options.set) set[name] = text_of(value);
            SessionOptions options = impl.session_options(set);
            if (!source.is_scene) options.knobs = knobs;
            const auto scripts = std::make_shared<Interruption>();
            options.interruption = scripts;
            {
                const SceneInside::Impl::Apart apart(impl, scripts);
                impl.session = std::make_unique<Session>(impl.file, std::move(options));
            }
            const SceneInside::Impl::Running running(impl);
            const Graph& graph = impl.session->graph();
            return f(*impl.session, source.is_scene ? with_arguments(graph, knobs) : graph);
        });
        if (result || !is_started || result.error().kind != SceneError::WrongScene) return result;
        SceneError failed = result.error();
        failed.kind = SceneError::FailedFrame;
        return failed;
    } catch (...) {
        return caught_error(SceneError::Unexpected);
    }
}

// Tells the program, and notes that the first frame is due.
StudyScene::Progress progress_of(const StudyProgress& progress, bool& is_started)
{
    return [&](int runs) {
        is_started = true;
        if (progress && !call_program("progress", progress, runs)) end_as_cancelled();
    };
}

void check_reference(const SceneStudy& study, const StudySource& source, const StudyReference* from)
{
    if (study.reference && study.compares() && !from)
        refuse("the reference is missing; compute that of the row's knobs first");
    if (source.is_scene && study.compares() && !study.reference)
        refuse("the study has no reference, and a scene no closed form; give the knobs that are taken for right");
    if (source.is_scene && study.error == "own")
        refuse("error = \"own\" is a function of a study file; of a scene it must be rms, max, p95 or residual");
}

void check_study(const SceneStudy& study)
{
    const std::string& error = study.error;
    if (error != "rms" && error != "max" && error != "p95" && error != "residual" && error != "own")
        refuse(fmt::format("error = \"{}\"; it must be rms, max, p95, residual or own", error));
    if (study.last <= study.first)
        refuse(fmt::format("frames {} to {}; the last must be behind the first", study.first, study.last));
    if (study.repeat_runs < 1) refuse(fmt::format("repeat_runs = {}; it must be at least 1", study.repeat_runs));
    for (const auto& [knob, values] : study.sweep)
        if (values.empty()) refuse(fmt::format("sweep: {} has no values", knob));
}

// Whether each knob of the sweep makes rows.
void check_lines(const SceneStudy& study)
{
    std::set<std::string> known;
    for (const std::string& line : study.lines) {
        if (!study.sweep.count(line)) refuse(fmt::format("lines: the sweep has no knob \"{}\"; call complete()", line));
        if (!known.insert(line).second) refuse(fmt::format("lines: \"{}\" is there twice", line));
    }
    known.insert(study_inside(study).step());
    for (const auto& [knob, values] : study.sweep)
        if (!known.count(knob))
            refuse(fmt::format("sweep: {} is neither among the lines nor the step; call complete()", knob));
}

void check_rows(const Study& study, const std::vector<StudyRun>& rows)
{
    const std::vector<Knobs> expected = study.rows();
    if (rows.size() != expected.size())
        refuse(fmt::format("there are {} rows; the study has {}", rows.size(), expected.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) {
        if (rows[i].knobs != knobs_in_header(expected[i]))
            refuse(fmt::format("row {} is not of the knobs {}; give the rows in the order of rows()", i + 1,
                               study.label(expected[i])));
        if (rows[i].failed.empty() && rows[i].seconds.empty())
            refuse(fmt::format("row {} ran and has no time; give it one, or say why it failed", i + 1));
    }
}

// What f gives, where nothing of a scene is needed.
template <class F>
auto without_scene(const F& f) -> Result<decltype(f())>
{
    try {
        return f();
    } catch (...) {
        return caught_error(SceneError::WrongCall);
    }
}

}  // namespace

struct [[gnu::visibility("hidden")]] StudyReference::Data { RecordLog frames = RecordLog::in_memory(); };

StudyReference::StudyReference(std::shared_ptr<Data> data) : data_(std::move(data)) {}

Result<StudyReference> StudyReference::make()
{
    return without_scene([] { return StudyReference(std::make_shared<Data>()); });
}

SceneValue knob_value(const std::string& text) { return value_in_header(read_argument(text)); }

double StudyRun::median_seconds() const
{
    StudyRow row;
    row.seconds = seconds;
    return seconds.empty() ? 0 : row.median_seconds();
}

Result<SceneStudy> SceneStudy::read(const StudySource& source)
{
    if (source.is_scene) return wrong_call("a scene has no study; is_scene is for those that the program describes");
    return with_scene(source, {}, false,
                      [](const Session& session, const Graph&) { return study_in_header(session.study()); });
}

Result<Done> SceneStudy::complete()
{
    return without_scene([&] {
        check_study(*this);
        Study study = study_inside(*this);
        study.complete();
        lines = study.lines;
        return Done();
    });
}

Result<std::vector<StudyKnobs>> SceneStudy::rows() const
{
    return without_scene([&] {
        check_study(*this);
        check_lines(*this);
        std::vector<StudyKnobs> rows;
        for (const Knobs& knobs : study_inside(*this).rows()) rows.push_back(knobs_in_header(knobs));
        return rows;
    });
}

std::string SceneStudy::label(const StudyKnobs& knobs) const { return Study().label(knobs_inside(knobs)); }

StudyKnobs SceneStudy::reference_of(const StudyKnobs& knobs) const
{
    return reference ? knobs_in_header(study_inside(*this).reference_of(knobs_inside(knobs))) : knobs;
}

Result<std::int64_t> SceneStudy::first_frame(const StudySource& source) const
{
    const Result<std::vector<StudyKnobs>> all = rows();
    if (!all) return all.error();
    if (all->empty()) return wrong_call("the study has no rows; give its knobs values");
    return with_scene(source, knobs_inside(all->front()), false, [&](const Session&, const Graph& graph) {
        return Plan(graph, {source.options.seed, {}}).first_frame();
    });
}

Result<Done> SceneStudy::compute_reference(const StudySource& source, const StudyKnobs& knobs,
                                           const StudyReference& into, const StudyProgress& progress) const
{
    bool is_started = false;
    return with_scene(source, knobs_inside(knobs), is_started, [&](const Session& session, Graph graph) {
        check_study(*this);
        const Study study = study_inside(*this);
        StudyScene(study, session, std::move(graph), source.options.seed)
            .keep_frames(into.data_->frames, progress_of(progress, is_started));
        return Done();
    });
}

Result<StudyRun> SceneStudy::measure(const StudySource& source, const StudyKnobs& knobs, const StudyReference* from,
                                     const StudyProgress& progress) const
{
    bool is_started = false;
    return with_scene(source, knobs_inside(knobs), is_started, [&](const Session& session, Graph graph) {
        check_study(*this);
        check_reference(*this, source, from);
        const Study study = study_inside(*this);
        const StudyRow row =
            StudyScene(study, session, std::move(graph), source.options.seed)
                .measure(knobs_inside(knobs), from ? &from->data_->frames : nullptr, progress_of(progress, is_started));
        return StudyRun{knobs, row.error, row.rounding, row.seconds, row.compared, row.missing, ""};
    });
}

Result<StudyReport> SceneStudy::report(const std::vector<StudyRun>& rows,
                                       const std::vector<std::pair<std::string, std::string>>& machine) const
{
    return without_scene([&] {
        check_study(*this);
        check_lines(*this);
        StudyResult result{study_inside(*this), {}, machine};
        check_rows(result.study, rows);
        for (const StudyRun& row : rows)
            result.rows.push_back(
                {knobs_inside(row.knobs), row.error, row.rounding, row.seconds, row.compared, row.missing, row.failed});
        return StudyReport{to_text(result),
                           to_json(result).dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace),
                           to_svg(result)};
    });
}

}  // namespace rapid
