#include "runtime/report/study.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "runtime/base/error.h"
#include "tests/test.h"

using namespace rapid;

namespace {

// Creates a study with a line per method and a step per number of substeps.
Study study_of_methods(std::vector<Value> methods, std::vector<Value> substeps)
{
    Study study;
    study.name = "ball";
    study.sweep = {{"method", std::move(methods)}, {"substeps", std::move(substeps)}};
    study.lines = {"method"};
    study.complete();
    return study;
}

// Fills in every row with the error and time that the functions return for its substeps.
template <class Error, class Seconds>
StudyResult run(const Study& study, const Error& error, const Seconds& seconds)
{
    StudyResult result{study, {}, {}};
    for (const Knobs& knobs : study.rows()) {
        StudyRow row;
        row.knobs = knobs;
        const double substeps = *knobs.at("substeps").get<double>();
        row.error = error(*knobs.at("method").get<std::string>(), substeps);
        row.seconds = {seconds(substeps)};
        row.rounding = 1e-7;
        result.rows.push_back(row);
    }
    return result;
}

std::string complaint(const std::function<void()>& act)
{
    try {
        act();
    } catch (const Error& error) {
        return error.what();
    }
    return "nothing was refused";
}

}  // namespace

TEST_CASE("the order is the slope of log error over log step, of rows above rounding", "[study]")
{
    const Study study = study_of_methods({"first", "second", "exact"}, {1.0, 2.0, 4.0, 8.0, 16.0});
    const StudyResult result = run(
        study,
        [](const std::string& method, double n) {
            if (method == "exact") return 3e-7;
            return method == "first" ? 0.1 / n : std::max(1e-5 / (n * n), 2e-7);  // the last two are rounding
        },
        [](double n) { return n; });

    const std::vector<StudyLine> lines = result.lines();
    REQUIRE(lines.size() == 3);
    CHECK(lines[0].name == "first");
    CHECK(lines[0].order.value() == Approx(1));
    CHECK(lines[0].fitted == 5);
    CHECK(lines[1].order.value() == Approx(2));
    CHECK(lines[1].fitted == 3);
    CHECK(lines[2].at_rounding);
    CHECK_FALSE(lines[2].order);
}

TEST_CASE("a knob that is not a whole number is the step's own size", "[study]")
{
    Study study;
    study.name = "cells";
    study.sweep = {{"voxel", {0.4, 0.2, 0.1}}};
    study.complete();
    StudyResult result{study, {}, {}};
    for (const Knobs& knobs : study.rows()) {
        StudyRow row;
        row.knobs = knobs;
        row.error = 5 * std::pow(*knobs.at("voxel").get<double>(), 3);
        row.seconds = {1};
        result.rows.push_back(row);
    }
    CHECK(result.lines().at(0).order.value() == Approx(3));
    CHECK(result.lines().at(0).name == "cells");
}

TEST_CASE("a row is best where none is as good in error and time and better in one", "[study]")
{
    const Study study = study_of_methods({"a"}, {1.0, 2.0, 3.0, 4.0, 5.0, 6.0});
    const std::vector<double> error = {1e-1, 1e-3, 1e-2, 2e-7, 1e-7, 1e-9};
    const std::vector<double> seconds = {1, 2, 3, 5, 6, 0};
    StudyResult result = run(
        study, [&](const std::string&, double n) { return error[static_cast<std::size_t>(n) - 1]; },
        [&](double n) { return seconds[static_cast<std::size_t>(n) - 1]; });
    result.rows[5].failed = "it crashed";  // so it beats no other row

    CHECK(result.best() == std::vector<bool>{true, true, false, true, false, false});  // 4 and 5 are both exact
}

TEST_CASE("the run time of a row is the median of its runs", "[study]")
{
    StudyRow row;
    row.seconds = {5, 1, 3};
    CHECK(row.median_seconds() == 3);
    row.seconds = {5, 1, 3, 2};
    CHECK(row.median_seconds() == 2.5);
}

TEST_CASE("rows come line by line, and the reference keeps the knobs that it does not name", "[study]")
{
    Study study = study_of_methods({"a", "b"}, {4.0, 1.0});
    study.reference = Knobs{{"substeps", 64.0}};
    const std::vector<Knobs> rows = study.rows();
    REQUIRE(rows.size() == 4);
    CHECK(study.label(rows[1]) == "method a, substeps 1");
    CHECK(study.line_of(rows[2]) == "b");
    CHECK(study.label(study.reference_of(rows[2])) == "method b, substeps 64");
}

TEST_CASE("a sweep whose step is in doubt, or with two equal rows, is refused", "[study]")
{
    Study study;
    study.sweep = {{"a", {1.0, 2.0}}, {"b", {1.0, 2.0}}};
    CHECK(complaint([&] { study.complete(); }) ==
          "a line can vary only one of the knobs a, b; name the others in lines: lines = \"a\"");
    study.lines = {"c"};
    CHECK(complaint([&] { study.complete(); }) == "lines: the sweep has no knob \"c\"");
    study.sweep = {{"a", {1.0, 1.0}}};
    CHECK(complaint([&] { study.complete(); }) == "sweep: a has the value 1 twice; remove one");
}

TEST_CASE("a parameter with strings has a line for each value, without an order", "[study]")
{
    Study study;
    study.sweep = {{"method", {std::string("a"), std::string("b")}}};
    study.complete();
    CHECK(study.lines == std::vector<std::string>{"method"});
    CHECK(study.step().empty());
}

TEST_CASE("a failed row is in the JSON and the table as failed, with its reason, and out of the picture", "[study]")
{
    StudyResult result = run(
        study_of_methods({"a"}, {1.0, 2.0}), [](const std::string&, double n) { return 0.1 / n; },
        [](double n) { return n; });
    result.rows[1].failed = "signal 11 <Segmentation fault>";

    const auto json = nlohmann::ordered_json::parse(to_json(result));
    CHECK(json["rows"][0]["error"] == 0.1);
    CHECK(json["rows"][1]["error"].is_null());
    CHECK(json["rows"][1]["failed"] == "signal 11 <Segmentation fault>");
    CHECK(json["lines"][0]["order"].is_null());
    CHECK_THAT(to_text(result), Catch::Contains("failed: method a, substeps 2: signal 11 <Segmentation fault>"));
    const std::string svg = to_svg(result);
    CHECK_THAT(svg, Catch::Contains(">1 failed<"));
    CHECK(svg.find("<circle") != svg.rfind("<circle"));  // the row's and the legend's
    CHECK(svg.find("<title>error 0.05") == std::string::npos);
}

TEST_CASE("the picture holds where every error is 0, and where nothing ran", "[study]")
{
    StudyResult result = run(
        study_of_methods({"a & b"}, {1.0, 2.0}), [](const std::string&, double) { return 0.0; },
        [](double n) { return n; });
    CHECK_THAT(to_svg(result), Catch::Contains("a &amp; b"));
    for (StudyRow& row : result.rows) row.failed = "no memory";
    const std::string svg = to_svg(result);
    CHECK(svg.find("nan") == std::string::npos);
    CHECK(svg.find("inf") == std::string::npos);
}
