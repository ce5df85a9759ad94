// Studies by a program: errors that a closed form says, runs against a reference, rows that fail, and what is refused.

#include <cmath>
#include <vector>

#include "include/rapid/study.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains, Catch::StartsWith;
using test::good;

// A point at rest that is pushed in the middle of each sub-step: v grows by dt² each time, so that after t seconds it
// is off by dt t²/2, of first order.
const std::string pushed =
    "local rapid = require 'rapid'\n"
    "local function scene(k)\n"
    "  return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }\n"
    "    :action('late', function(p, step) p.v = p.v + vec3(0, step.dt ^ 2, 0) end) :solve { substeps = k.substeps }\n"
    "end\n";
const std::string pushed_study =
    pushed +
    "return rapid.study { name = 'late', scene = scene, frames = {1, 13}, repeat_runs = 2,\n"
    "  error = 'max', sweep = { substeps = {1, 2} },\n"
    "  reference = function() return { P = {{0, 0, 0}} } end }\n";
const std::string pushed_scene = pushed + "return scene { substeps = 1 }\n";

double off(double frames, double substeps) { return 1 / (24 * substeps) * std::pow(frames / 24, 2) / 2; }

struct Source {
    test::TemporaryFolder folder;
    StudySource source;

    explicit Source(const std::string& text, bool is_scene = false)
    {
        source.file = folder.write("late.lua", text);
        source.is_scene = is_scene;
    }
};

// Of the scene: against 64 sub-steps.
SceneStudy swept()
{
    SceneStudy study;
    study.name = "late";
    study.sweep["solve.substeps"] = {1.0, 2.0};
    study.reference = {{"solve.substeps", 64.0}};
    study.last = 13;
    study.error = "max";
    study.repeat_runs = 1;
    good(study.complete());
    return study;
}

}  // namespace

TEST_CASE("a study file is read, and its rows have the errors that the closed form says", "[study]")
{
    const Source file(pushed_study);
    const SceneStudy study = good(SceneStudy::read(file.source));
    CHECK(study.name == "late");
    CHECK(study.last == 13);
    CHECK(study.repeat_runs == 2);
    CHECK_FALSE(study.reference);
    const std::vector<StudyKnobs> rows = good(study.rows());
    REQUIRE(rows == std::vector<StudyKnobs>{{{"substeps", 1.0}}, {{"substeps", 2.0}}});
    CHECK(study.label(rows[1]) == "substeps 2");

    std::vector<StudyRun> runs;
    for (const StudyKnobs& knobs : rows) {
        std::vector<int> told;
        runs.push_back(good(study.measure(file.source, knobs, nullptr, [&](int done) {
            told.push_back(done);
            return true;
        })));
        CHECK(told == std::vector<int>{0, 1, 2, 3});
        const StudyRun& run = runs.back();
        CHECK(run.knobs == knobs);
        CHECK(run.error == Approx(off(12, std::get<double>(knobs.at("substeps")))).epsilon(1e-4));
        CHECK(run.compared == 12);
        CHECK(run.missing == 0);
        REQUIRE(run.seconds.size() == 2);
        CHECK(run.median_seconds() == Approx((run.seconds[0] + run.seconds[1]) / 2));
    }

    runs.push_back(runs.back());
    CHECK_THAT(study.report(runs).error().message, Contains("there are 3 rows; the study has 2"));
    runs.pop_back();
    const StudyReport report = good(study.report(runs, {{"processor", "of a test"}}));
    CHECK_THAT(report.text, StartsWith("late: max error of P (m), frames 2 to 13, against the closed form"));
    CHECK_THAT(report.json, Contains(R"("processor": "of a test")") && Contains(R"("order": )"));
    CHECK_THAT(report.svg, StartsWith("<svg"));
}

TEST_CASE("a scene is swept against a reference of its own", "[study]")
{
    const Source scene(pushed_scene, true);
    const SceneStudy study = swept();
    CHECK(good(study.first_frame(scene.source)) == 1);
    const StudyKnobs knobs = good(study.rows()).front(), right = study.reference_of(knobs);
    CHECK(right == StudyKnobs{{"solve.substeps", 64.0}});

    const StudyReference reference = good(StudyReference::make());
    const double expected = off(12, 1) - off(12, 64);
    SECTION("in this process, twice, which replaces it")
    {
        for (int time = 0; time < 2; ++time) good(study.compute_reference(scene.source, right, reference));
        CHECK(good(study.measure(scene.source, knobs, &reference)).error == Approx(expected).epsilon(1e-4));
    }
    SECTION("and copies are of the same frames")
    {
        const StudyReference copy = reference;
        good(study.compute_reference(scene.source, right, copy));
        CHECK(good(study.measure(scene.source, knobs, &reference)).error == Approx(expected).epsilon(1e-4));
    }
    SECTION("and where it is not computed there is no frame to compare with")
    {
        const Result<StudyRun> run = study.measure(scene.source, knobs, &reference);
        REQUIRE_FALSE(run);
        CHECK(run.error().kind == SceneError::FailedFrame);
        CHECK_THAT(run.error().message, Contains("the reference has no frame 2"));
    }
}

TEST_CASE("a study ends where the program says so", "[study]")
{
    const Source scene(pushed_scene, true);
    const SceneStudy study = swept();
    const StudyKnobs knobs = good(study.rows()).front();
    const StudyReference reference = good(StudyReference::make());
    CHECK(study.compute_reference(scene.source, knobs, reference, [](int) { return false; }).error().kind ==
          SceneError::Cancelled);
    good(study.compute_reference(scene.source, knobs, reference));
    int last = 0;
    const Result<StudyRun> run =
        study.measure(scene.source, knobs, &reference, [&](int runs) { return (last = runs) < 1; });
    REQUIRE_FALSE(run);
    CHECK(run.error().kind == SceneError::Cancelled);
    CHECK(last == 1);
}

TEST_CASE("a setting that fails is told from one that the scene refuses", "[study]")
{
    const Source scene(
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }\n"
        "  :points('warm', function(p, frame) if frame.number == 4 then error 'hot' end end) :solve {}\n",
        true);
    SceneStudy study = swept();
    const StudyReference reference = good(StudyReference::make());
    const auto kind = [&](const StudyKnobs& knobs) {
        const Result<Done> done = study.compute_reference(scene.source, knobs, reference);
        REQUIRE_FALSE(done);
        return done.error().kind;
    };
    CHECK(kind({{"solve.substeps", 2.0}}) == SceneError::FailedFrame);
    CHECK(kind({{"solve.substeps", -1.0}}) == SceneError::WrongScene);
    CHECK(kind({{"sovle.substeps", 1.0}}) == SceneError::WrongScene);
    study.first = -4;
    CHECK(kind({{"solve.substeps", 2.0}}) == SceneError::WrongScene);
}

TEST_CASE("a script of a study that takes too long is stopped, and what it prints is told", "[study]")
{
    Source scene(
        "local rapid = require 'rapid'\n"
        "print('opened')\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }\n"
        "  :points('turn', function(p) while true do end end) :solve {}\n",
        true);
    std::string late, printed;
    scene.source.options.script_seconds = 0.2;
    scene.source.options.log = [&](LogLevel, const std::string& text) { printed += text; };
    scene.source.hooks.late = [&](const std::string& message) { late = message; };
    const Result<Done> done =
        swept().compute_reference(scene.source, {{"solve.substeps", 2.0}}, good(StudyReference::make()));
    REQUIRE_FALSE(done);
    CHECK(done.error().kind == SceneError::TooLong);
    CHECK_THAT(late, Contains("runs for more than 0.2 s"));
    CHECK(printed == "opened");
}

TEST_CASE("what is no study is refused", "[study]")
{
    const auto fault = [](const std::function<void(SceneStudy & study)>& change) {
        SceneStudy study = swept();
        study.lines.clear();
        change(study);
        const Result<Done> done = study.complete();
        REQUIRE_FALSE(done);
        CHECK(done.error().kind == SceneError::WrongCall);
        return done.error().message;
    };
    CHECK_THAT(fault([](SceneStudy& study) { study.error = "mean"; }), Contains("error = \"mean\""));
    CHECK_THAT(fault([](SceneStudy& study) { study.last = 1; }), Contains("the last must be behind the first"));
    CHECK_THAT(fault([](SceneStudy& study) { study.repeat_runs = 0; }), Contains("repeat_runs = 0"));
    CHECK_THAT(fault([](SceneStudy& study) { study.sweep["n"] = {}; }), Contains("n has no values"));
    CHECK_THAT(fault([](SceneStudy& study) { study.sweep["n"] = {1.0, 1.0}; }), Contains("the value 1 twice"));
    CHECK_THAT(fault([](SceneStudy& study) { study.sweep["n"] = {1.0}; }), Contains("all left for the step"));
    CHECK_THAT(fault([](SceneStudy& study) { study.lines = {"m"}; }), Contains("no knob \"m\""));

    const Source scene(pushed_scene, true), file(pushed_study);
    SceneStudy study = swept();
    const StudyKnobs knobs = good(study.rows()).front();
    const auto kind = [](const auto& result) {
        REQUIRE_FALSE(result);
        return result.error().kind;
    };
    CHECK(kind(study.measure(scene.source, knobs, nullptr)) == SceneError::WrongCall);
    CHECK(kind(SceneStudy::read(scene.source)) == SceneError::WrongCall);
    CHECK(kind(SceneStudy::read({})) == SceneError::WrongCall);
    study.reference.reset();
    CHECK(kind(study.measure(scene.source, knobs, nullptr)) == SceneError::WrongCall);
    study.error = "own";
    CHECK(kind(study.measure(scene.source, knobs, nullptr)) == SceneError::WrongCall);
    study.lines = {"m"};
    CHECK(kind(study.rows()) == SceneError::WrongCall);
    CHECK(kind(SceneStudy().first_frame(file.source)) == SceneError::WrongScene);
    StudySource wrong = scene.source;
    wrong.options.threads = -1;
    CHECK(kind(swept().first_frame(wrong)) == SceneError::WrongCall);
}

TEST_CASE("a knob may be a vector", "[study]")
{
    const Source scene(
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } } :gravity { name = 'down' } :solve {}\n",
        true);
    SceneStudy study;
    study.sweep["down.g"] = {knob_value("{0, -8, 0}"), knob_value("{0, -6, 0}")};
    study.reference = {{"down.g", knob_value("{0, -8, 0}")}};
    study.last = 13;
    study.error = "max";
    study.repeat_runs = 1;
    good(study.complete());
    const StudyReference reference = good(StudyReference::make());
    good(study.compute_reference(scene.source, *study.reference, reference));
    std::vector<StudyRun> runs;
    for (const StudyKnobs& knobs : good(study.rows()))
        runs.push_back(good(study.measure(scene.source, knobs, &reference)));
    CHECK(runs[0].error == 0);
    CHECK(runs[1].error == Approx(2 * 0.5 * 0.5 / 2));  // Δg t²/2
    CHECK_THAT(good(study.report(runs)).text, Contains("{0, -6, 0}"));
}

TEST_CASE("the value of a knob is read as from a command line", "[study]")
{
    CHECK(knob_value("true") == SceneValue(true));
    CHECK(knob_value("0.5") == SceneValue(0.5));
    CHECK(knob_value("{1, 2, 3}") == SceneValue(std::array<double, 3>{1, 2, 3}));
    CHECK(knob_value("euler") == SceneValue(std::string("euler")));
}

}  // namespace rapid
