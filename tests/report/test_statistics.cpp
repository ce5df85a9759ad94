#include <nlohmann/json.hpp>

#include "runtime/report/error_budget.h"
#include "runtime/report/number_text.h"
#include "runtime/report/statistics.h"
#include "tests/test.h"

using namespace rapid;
using nlohmann::ordered_json;

namespace {

FrameResult frame_result()
{
    FrameResult result;
    result.frame = 7;
    result.outputs["main"].append(3);
    result.outputs["smoke"].append(2);
    result.figures.born = 4;
    result.figures.died = 1;
    result.figures.collisions = 12;
    result.figures.contact_limit = 3;
    result.figures.trapped = 2;
    result.figures.substeps = 2;
    result.figures.asleep = 3;
    result.figures.penetration_max = 0.25;
    result.figures.contact_energy = {0.5, 3};
    result.figures.bands = {{"collide1", 0.125, 5000, 0.5}};
    result.figures.seconds.script = 0.125;
    result.figures.seconds.solve = 0.5;
    result.total_seconds = 1;
    // The work of a frame with two subframes.
    result.work = {{{"emit1"}, NodeWork::Stage::Graph, 0, 0.25, 2, 64},
                   {{"tint", "fade"}, NodeWork::Stage::Script, 0.25, 0.125, 2, 64},
                   {{"emit1"}, NodeWork::Stage::Graph, 0.5, 0.125, 3, 96}};
    return result;
}

// A run with its frames, which RunStatistics itself does not store.
struct Recorded : RunStatistics {
    std::vector<FrameFigures> frames;
};

std::string to_json(const Recorded& run)
{
    std::string text = json_head(run);
    for (const FrameFigures& frame : run.frames) text += json_line(frame, &frame == run.frames.data());
    return text + json_end(run);
}

std::string summary(const Recorded& run)
{
    RunTotals totals;
    for (const FrameFigures& frame : run.frames) totals.add(frame);
    return summary(run, totals);
}

Recorded run_of(std::initializer_list<std::uint64_t> points)
{
    Recorded run;
    run.graph = "sparks.lua";
    run.threads = 2;
    run.peak_bytes = 3 << 20;
    run.seconds = 0.5;
    for (const std::uint64_t count : points) {
        FrameFigures frame;
        frame.frame = static_cast<std::int64_t>(run.frames.size()) + 1;
        frame.points = count;
        run.frames.push_back(frame);
    }
    return run;
}

std::vector<std::string> keys_of(const ordered_json& json)
{
    std::vector<std::string> keys;
    for (const auto& [key, value] : json.items()) keys.push_back(key);
    return keys;
}

}  // namespace

TEST_CASE("a frame's stages before writing add up to its wall time", "[report]")
{
    const FrameFigures frame = statistics_of(frame_result());
    CHECK(frame.seconds.script == 0.125);
    CHECK(frame.seconds.solve == 0.5);
    CHECK(frame.seconds.graph == 0.375);
    CHECK(frame.seconds.total() == 1);
}

TEST_CASE("stages that were timed longer than the whole leave nothing to the graph", "[report]")
{
    FrameResult result = frame_result();
    result.total_seconds = 0.5;
    CHECK(statistics_of(result).seconds.graph == 0);
}

TEST_CASE("a frame's points are those of all its outputs", "[report]")
{
    CHECK(statistics_of(frame_result()).points == 5);
}

TEST_CASE("the statistics file has the shape of the contract", "[report]")
{
    Recorded run = run_of({});
    run.frames.push_back(statistics_of(frame_result()));
    run.frames.front().seconds.write = 0.25;
    const ordered_json json = ordered_json::parse(to_json(run));

    CHECK(keys_of(json) == std::vector<std::string>{"graph", "threads", "frames", "peak_bytes", "seconds"});
    CHECK(json["graph"] == "sparks.lua");
    CHECK(json["threads"] == 2);
    CHECK(json["peak_bytes"] == 3 << 20);
    CHECK(json["seconds"] == 0.5);
    REQUIRE(json["frames"].size() == 1);
    // Without an estimate there is no "error" entry.
    CHECK(json["frames"][0] == ordered_json::parse(R"({
        "frame": 7, "points": 5, "born": 4, "died": 1, "substeps": 2,
        "seconds": { "total": 1.25, "graph": 0.375, "script": 0.125, "solve": 0.5, "write": 0.25 },
        "rounding": 0.0, "energy_drift": null, "penetration_max": 0.25, "constraint_residual_max": 0.0, "asleep": 3,
        "collisions": 12,
        "contact_energy": { "added": 0.5, "lost": 3.0 },
        "bands": [ { "node": "collide1", "width": 0.125, "voxels": 5000, "seconds": 0.5 } ],
        "contact_limit": 3, "trapped": 2, "beyond_tolerance": 0,
        "nodes": [ { "nodes": ["emit1"], "seconds": 0.375, "points": 3, "bytes": 96 },
                   { "nodes": ["tint", "fade"], "seconds": 0.125, "points": 2, "bytes": 64 } ] })"));
}

TEST_CASE("estimated errors have their median, 95 % and maximum in the file, and the last two in the summary",
          "[report]")
{
    FrameResult result = frame_result();
    for (int i = 100; i >= 0; --i) result.figures.error.values.push_back(i * 1e-4);
    Recorded run = run_of({});
    run.frames.push_back(statistics_of(result));
    const ordered_json error = ordered_json::parse(to_json(run))["frames"][0]["error"];
    CHECK(error["position_p50"] == 50 * 1e-4);
    CHECK(error["position_p95"] == 95 * 1e-4);
    CHECK(error["position_max"] == 100 * 1e-4);
    CHECK_THAT(summary(run),
               Catch::Contains("\nerror    estimated: 95 % of the positions within 9.5 mm, all within 1 cm\n"));
}

TEST_CASE("the summary says why no error is estimated, unless nothing was solved", "[report]")
{
    FrameResult result = frame_result();
    result.figures.error.values.clear();
    result.figures.left_out_of_errors = {"all points, as they are strange"};
    Recorded run = run_of({});
    run.frames = {statistics_of(result)};
    CHECK_THAT(summary(run), Catch::Contains("\nerror    not estimated: all points, as they are strange\n"));
    CHECK_THAT(summary(run), !Catch::Contains("none found"));
    const ordered_json frame = ordered_json::parse(to_json(run))["frames"][0];
    CHECK_FALSE(frame.contains("error"));
    CHECK(frame["left_out_of_errors"] == ordered_json{"all points, as they are strange"});

    result.figures.substeps = 0;
    run.frames = {statistics_of(result)};
    CHECK_THAT(summary(run), !Catch::Contains("error  "));
}

TEST_CASE("the summary has the largest error of a single frame, and the number of frames with one", "[report]")
{
    FrameResult result = frame_result();
    Recorded run = run_of({});
    for (int k = 0; k < 5; ++k) {
        result.frame = 10 + k;
        result.figures.frame_error.values.clear();
        for (int i = 0; k % 2 == 1 && i <= 100; ++i) result.figures.frame_error.values.push_back(k * i * 1e-4);
        if (k == 2) result.figures.left_out_of_errors = {"the rest"};
        run.frames.push_back(statistics_of(result));
    }
    CHECK(ordered_json::parse(to_json(run))["frames"][1]["frame_error"]["position_p95"] == 95 * 1e-4);
    CHECK_FALSE(ordered_json::parse(to_json(run))["frames"][2].contains("frame_error"));
    CHECK_THAT(summary(run),
               Catch::Contains("\nerror    from substeps: 95 % of the positions within 2.9 cm, all within 3 cm, in one "
                               "frame (2 of 5 estimated); not estimated: the rest (from frame 12 on)\n"));
}

TEST_CASE("95 % of fewer than 20 points are all points", "[report]")
{
    const auto p95_of_points = [](int points) {
        std::vector<double> errors;
        for (int i = 1; i <= points; ++i) errors.push_back(i);
        return ErrorQuantiles::of(errors).p95;
    };
    for (const int points : {1, 2, 19}) CHECK(p95_of_points(points) == points);
    CHECK(p95_of_points(20) == 19);
    CHECK(p95_of_points(21) == 20);
    CHECK(p95_of_points(100) == 95);
}

TEST_CASE("the error by rounding is in the file, apart from the estimated error", "[report]")
{
    FrameResult result = frame_result();
    result.figures.error.values = {0};
    result.figures.rounding = 0.25;
    Recorded run = run_of({});
    run.frames.push_back(statistics_of(result));
    CHECK(ordered_json::parse(to_json(run))["frames"][0]["rounding"] == 0.25);
    CHECK_THAT(summary(run), Catch::Contains("\nerror    none found: twice the substeps give the same positions\n"));
}

TEST_CASE("an error is 0 only if all motion has a closed form, and complete only if no source is left out", "[report]")
{
    FrameResult result = frame_result();
    result.figures.error.values = {0, 0};
    result.figures.rounding = 0.25;
    Recorded run = run_of({});
    run.frames.push_back(statistics_of(result));
    const auto total = [&] { return *error_budget_of(run.frames.front(), run.errors); };
    CHECK(total().solver->p50 == 0.25);
    CHECK_FALSE(total().is_exact);
    CHECK(total().is_complete);

    run.errors.is_closed_form = true;
    CHECK(total().solver->max == 0);
    CHECK(total().total.max == 0.25);
    CHECK_THAT(summary(run), Catch::Contains("\nerror    0, but for rounding within 25 cm\n"));

    run.errors.unmeasured = {{UnmeasuredError::Graph, "swirl, which changes v"},
                             {UnmeasuredError::Shapes, "ball.shape, a level set"}};
    CHECK_FALSE(total().is_complete);
    CHECK_THAT(summary(run),
               Catch::Contains("\nerror    not estimated: swirl, which changes v; ball.shape, a level set; "
                               "twice the substeps give the same positions within rounding\n"));
}

TEST_CASE("if a source of error is not estimated, the summary names it, and does not call the run fine", "[report]")
{
    FrameResult result = frame_result();
    result.figures.contact_limit = result.figures.trapped = 0;
    result.figures.rounding = 0.001;
    const auto text = [&](std::vector<double> errors) {
        result.figures.error.values = std::move(errors);
        Recorded run = run_of({});
        run.frames.push_back(statistics_of(result));
        run.errors.unmeasured = {{UnmeasuredError::Graph, "kick, which changes v"}};
        return summary(run);
    };
    CHECK_THAT(text({0, 0.0005}), Catch::Contains("\nerror    not estimated: kick, which changes v; twice the substeps "
                                                  "give the same positions within rounding\n"));
    CHECK_THAT(text({0, 0.004}), Catch::Contains("\nerror    from substeps: all positions within 5 mm; not estimated: "
                                                 "kick, which changes v\n"));
    std::vector<double> errors(30, 0.004);
    errors.front() = 0.008;
    CHECK_THAT(text(errors), Catch::Contains("\nerror    from substeps: 95 % of the positions within 5 mm, all within "
                                             "9 mm; not estimated: kick, which changes v\n"));
    CHECK_THAT(text(errors), !Catch::Contains("look at ") && !Catch::Contains("all fine"));
    CHECK_THAT(text(errors), Catch::EndsWith("\nresult   nothing to look at, but not all of the error is estimated\n"));
}

TEST_CASE("a complete error contains the rounding", "[report]")
{
    FrameResult result = frame_result();
    result.figures.rounding = 0.25;
    result.figures.error.values = {0.125, 0.5};
    Recorded run = run_of({});
    run.frames.push_back(statistics_of(result));
    CHECK_THAT(summary(run), Catch::Contains("\nerror    estimated: all positions within 75 cm\n"));
}

TEST_CASE("a drift of energy has its mean and its largest magnitude in the file, if there is an energy", "[report]")
{
    FrameResult result = frame_result();
    result.figures.energy_drift.values = {0.5, -2, 0};
    Recorded run = run_of({});
    run.frames.push_back(statistics_of(result));
    CHECK(ordered_json::parse(to_json(run))["frames"][0]["energy_drift"] == ordered_json{{"mean", -0.5}, {"max", 2.0}});

    result.figures.energy_drift.is_defined = false;
    run.frames.push_back(statistics_of(result));
    CHECK(ordered_json::parse(to_json(run))["frames"][1]["energy_drift"].is_null());
}

TEST_CASE("a run that ended before its first frame has an empty list of frames", "[report]")
{
    const ordered_json json = ordered_json::parse(to_json(run_of({})));
    CHECK(json["frames"].is_array());
    CHECK(json["frames"].empty());
}

TEST_CASE("any name of a graph makes a file that can be parsed", "[report]")
{
    Recorded run = run_of({1, 2});
    run.graph = "a\"b\\c\n\xff.lua";
    CHECK_NOTHROW(ordered_json::parse(to_json(run)));
}

TEST_CASE("a statistics file has a line for each frame", "[report]")
{
    const std::string text = to_json(run_of({1, 2, 3}));
    CHECK(std::count(text.begin(), text.end(), '\n') == 3 + 4);
}

TEST_CASE("the summary of a run is six aligned lines", "[report]")
{
    Recorded run = run_of({100, 2000, 1500});
    run.frames[1].substeps = 1;
    run.frames[0].nodes = {{{"emit1"}, NodeWork::Stage::Graph, 0, 0.25, 100, 0},
                           {{"tint", "fade"}, NodeWork::Stage::Script, 0, 0.5, 100, 0}};
    run.frames[2].nodes = {{{"emit1"}, NodeWork::Stage::Graph, 0, 0.5, 1500, 0},
                           {{"solve1"}, NodeWork::Stage::Solve, 0, 0.25, 1500, 0}};
    run.frames[2].error.summary = ErrorQuantiles{1e-6, 2.5e-4, 0.0034};
    RunTotals totals;
    for (const FrameFigures& frame : run.frames) totals.add(frame);
    CHECK(summary(run, totals) ==
          "points   1,500 (most: 2,000 in frame 2)\n"
          "frames   3 in 0.500 s, 7,200 points per second, 3.0 MiB of memory\n"
          "slowest  emit1, 50 % of the work\n"
          "error    estimated: 95 % of the positions within 250 µm, all within 3.4 mm\n"
          "files    none written; output NAME.####.png writes pictures\n"
          "result   all fine\n");

    // The first file has no points, as nothing is born yet; the one to look at is that with the most.
    totals.add_file("snow.0001.png", false, 0, 0.5);
    totals.add_file("snow.0002.png", false, 2000, 0.5);
    totals.add_file("snow.0003.png", false, 1500, 0.5);
    for (int frame = 0; frame < 3; ++frame) totals.add_file("snow.mp4", true, 1, 0.25);
    CHECK_THAT(summary(run, totals), Catch::Contains("\nslowest  writing .png, 40 % of the work\n"));
    CHECK_THAT(summary(run, totals), Catch::Contains("\nfiles    4 written; look at snow.0002.png\n"));
}

TEST_CASE("instead of all fine, the summary has a line for each thing to look at, with a remedy", "[report]")
{
    Recorded run = run_of({1, 1, 1, 1});
    CHECK_THAT(summary(run), Catch::EndsWith("\nresult   all fine\n") && !Catch::Contains("look at"));
    run.frames[1].contact_limit = 1000;
    run.frames[3].contact_limit = 234;
    run.frames[2].trapped = 1;
    run.frames[3].error.summary = ErrorQuantiles{0.01, 0.5, 1};
    CHECK_THAT(summary(run),
               Catch::EndsWith("look at  points reached the limit of contacts in a step 1,234 times, in 2 frames from "
                               "2 to 4: give :solve more substeps\n"
                               "look at  points could not be moved out of a shape once, in frame 3: emit them outside, "
                               "or move the shapes apart\n"
                               "look at  the error of positions is visible: give :solve more substeps\n"));
    CHECK_THAT(summary(run), !Catch::Contains("all fine"));

    RunTotals warned;
    ++warned.warnings;
    CHECK_THAT(summary(run, warned), Catch::EndsWith("\nlook at  the warning above\n"));
    ++warned.warnings;
    CHECK_THAT(summary(run, warned), Catch::EndsWith("\nlook at  the 2 warnings above\n"));
}

TEST_CASE("the summary of an empty scene says that there are no points, not that no frame was run", "[report]")
{
    CHECK_THAT(summary(run_of({0, 0})),
               Catch::StartsWith("points   0\nframes   2 in 0.500 s, 3.0 MiB of memory\n") &&
                   Catch::Contains(
                       "look at  no frame has a point: emit more, keep points alive for longer, or run more frames\n"));
    CHECK_THAT(summary(run_of({})), Catch::StartsWith("points   none: no frame was run\n"));
}

TEST_CASE("numbers read as people write them", "[report]")
{
    CHECK(with_separators(0) == "0");
    CHECK(with_separators(999) == "999");
    CHECK(with_separators(1000) == "1,000");
    CHECK(with_separators(1234567) == "1,234,567");
    CHECK(in_millions(99999) == "99,999");
    CHECK(in_millions(3.214e6) == "3.21 million");
    CHECK(in_millions(45.67e6) == "45.7 million");
    CHECK(memory_text(std::uint64_t{5} << 29) == "2.50 GiB");
    CHECK(duration_text(0.0421) == "0.042 s");
    CHECK(duration_text(59.4) == "59.4 s");
    CHECK(duration_text(59.97) == "60.0 s");
    CHECK(duration_text(125) == "2 min 05 s");
    CHECK(duration_text(3725) == "1 h 02 min");
    CHECK(length_text(2.5) == "2.5 m");
    CHECK(length_text(0.034) == "3.4 cm");
    CHECK(length_text(0.0034) == "3.4 mm");
    CHECK(length_text(7.5e-7) == "0.75 µm");
    CHECK(length_text(2.5e-4) == "250 µm");
    CHECK(length_text(0.9997) == "100 cm");
}
