#include "bindings/command/study_run.h"

#include <unistd.h>

#include <exception>
#include <new>
#include <nlohmann/json.hpp>

#include "bindings/command_line/command.h"
#include "bindings/command_line/or_throw.h"
#include "runtime/threads.h"

namespace rapid {
namespace {

using nlohmann::json;

json json_of(const SceneValue& value)
{
    return std::visit([](const auto& held) { return json(held); }, value);
}

SceneValue value_of(const json& value)
{
    if (value.is_boolean()) return value.get<bool>();
    if (value.is_string()) return value.get<std::string>();
    if (value.is_array()) return value.get<std::array<double, 3>>();
    return value.get<double>();
}

json to_event(const SceneStudy& study)
{
    json sweep = json::object(), reference;
    for (const auto& [knob, values] : study.sweep)
        for (const SceneValue& value : values) sweep[knob].push_back(json_of(value));
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

// The parent tells it.
std::function<void(const std::string& message)> end_at_limit(const TellParent& tell)
{
    return [tell](const std::string& message) {
        tell({{"failed", message}, {"refused", false}});
        _exit(status_done);
    };
}

// Tells the error that `work` raises, which gets the source with the child's hooks. It sets `started` when its first
// frame is due.
void guarded(const StudyChild& child, const TellParent& tell,
             const std::function<void(const StudySource& source, bool& started)>& work)
{
    StudySource source = child.source;
    source.options.log = [](LogLevel, const std::string& text) { print(text + '\n'); };
    source.hooks.late = source.hooks.beyond_memory = end_at_limit(tell);
    Threads threads(child.threads);
    bool started = false;
    std::string failed;
    try {
        threads.run([&] { work(source, started); });
        return;
    } catch (const std::bad_alloc&) {
        failed = "out of memory";
    } catch (const std::exception& error) {
        failed = error.what();
    }
    tell({{"failed", failed}, {"refused", !started}});
}

}  // namespace

SceneStudy read_study(const json& event)
{
    const json& told = event.at("study");
    SceneStudy study;
    study.file = told.at("file");
    study.name = told.at("name");
    for (const auto& [knob, values] : told.at("sweep").items())
        for (const json& value : values) study.sweep[knob].push_back(value_of(value));
    study.lines = told.at("lines").get<std::vector<std::string>>();
    study.first = told.at("frames")[0];
    study.last = told.at("frames")[1];
    study.error = told.at("error");
    study.last_frame_only = told.at("last_frame_only");
    if (!told.at("reference").is_null()) {
        study.reference.emplace();
        for (const auto& [knob, value] : told.at("reference").items()) (*study.reference)[knob] = value_of(value);
    }
    study.repeat_runs = told.at("repeat_runs");
    return study;
}

StudyRun read_row(const json& event, StudyKnobs knobs)
{
    const json& told = event.at("row");
    StudyRun row;
    row.knobs = std::move(knobs);
    row.error = told.at("error");
    row.rounding = told.at("rounding");
    row.seconds = told.at("seconds").get<std::vector<double>>();
    row.compared = told.at("compared");
    row.missing = told.at("missing");
    return row;
}

void describe_study(const StudyChild& child, const SceneStudy& asked, bool default_frames, const TellParent& tell)
{
    guarded(child, tell, [&](const StudySource& source, bool&) {
        SceneStudy study = asked;
        if (source.is_scene) {
            const std::int64_t first = or_throw(study.first_frame(source));
            if (default_frames) {
                study.last += first - study.first;
                study.first = first;
            }
        } else {
            study = or_throw(SceneStudy::read(source));
        }
        tell({{"study", to_event(study)}});
    });
}

void run_reference(const StudyChild& child, const SceneStudy& study, const StudyKnobs& knobs,
                   const StudyReference& reference, const TellParent& tell)
{
    guarded(child, tell, [&](const StudySource& source, bool& started) {
        or_throw(study.compute_reference(source, knobs, reference, [&](int) { return started = true; }));
        tell({{"kept", true}});
    });
}

void run_row(const StudyChild& child, const SceneStudy& study, const StudyKnobs& knobs, const StudyReference* reference,
             const TellParent& tell)
{
    guarded(child, tell, [&](const StudySource& source, bool& started) {
        const StudyRun row = or_throw(study.measure(source, knobs, reference, [&](int runs) {
            started = true;
            if (runs > 0) tell({{"run", runs}});
            return true;
        }));
        tell({{"row",
               {{"error", row.error},
                {"rounding", row.rounding},
                {"seconds", row.seconds},
                {"compared", row.compared},
                {"missing", row.missing}}}});
    });
}

}  // namespace rapid
