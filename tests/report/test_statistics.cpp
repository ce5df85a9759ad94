#include <nlohmann/json.hpp>

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

TEST_CASE("estimated errors are told by their median, 95 % and largest, in the file and in the summary", "[report]")
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
               Catch::Contains("half of the points below 5.0e-03 m, 95 % below 9.5e-03, the worst 1.0e-02"));
}

TEST_CASE("where no error is estimated, that is told, and why; unless nothing was solved", "[report]")
{
    FrameResult result = frame_result();
    result.figures.error.values.clear();
    result.figures.left_out_of_errors = {"all points, as they are strange"};
    Recorded run = run_of({});
    run.frames = {statistics_of(result)};
    CHECK_THAT(summary(run),
               Catch::Contains("\nerror    not estimated\nleft out of the error: all points, as they are strange\n"));
    CHECK_THAT(summary(run), !Catch::Contains("the same at"));
    const ordered_json frame = ordered_json::parse(to_json(run))["frames"][0];
    CHECK_FALSE(frame.contains("error"));
    CHECK(frame["left_out_of_errors"] == ordered_json{"all points, as they are strange"});

    result.figures.substeps = 0;
    run.frames = {statistics_of(result)};
    CHECK_THAT(summary(run), !Catch::Contains("error  "));
}

TEST_CASE("errors of single frames are told by the worst of these frames, and their number", "[report]")
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
    CHECK_THAT(summary(run), Catch::Contains("\nerror    of one frame, estimated in 2 of 5: half of the points below "
                                             "1.5e-02 m, 95 % below 2.9e-02, the worst 3.0e-02 (frame 13)\n"
                                             "left out of the error: the rest (from frame 12 on)\n"));
}

TEST_CASE("what rounding is off by is told by its largest, apart from the estimated error", "[report]")
{
    FrameResult result = frame_result();
    result.figures.error.values = {0};
    result.figures.rounding = 0.25;
    Recorded run = run_of({});
    run.frames.push_back(statistics_of(result));
    CHECK(ordered_json::parse(to_json(run))["frames"][0]["rounding"] == 0.25);
    CHECK_THAT(summary(run), Catch::Contains("\nrounding of positions since birth: 2.5e-01 m at most (frame 7)\n"));
}

TEST_CASE("a drift of energy is told by its mean and its largest, whichever way, where there is an energy", "[report]")
{
    FrameResult result = frame_result();
    result.figures.energy_drift.values = {0.5, -2, 0};
    Recorded run = run_of({});
    run.frames.push_back(statistics_of(result));
    CHECK(ordered_json::parse(to_json(run))["frames"][0]["energy_drift"] == ordered_json{{"mean", -0.5}, {"max", 2.0}});
    CHECK_THAT(summary(run),
               Catch::Contains("collisions aside: -5.0e-01 J/kg since birth on average, 2.0e+00 at most"));

    result.figures.energy_drift.is_defined = false;
    run.frames.push_back(statistics_of(result));
    CHECK(ordered_json::parse(to_json(run))["frames"][1]["energy_drift"].is_null());
    CHECK_THAT(summary(run), !Catch::Contains("of motion"));
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

TEST_CASE("the summary says points, frames, seconds by stage and memory", "[report]")
{
    Recorded run = run_of({100, 2000, 1500});
    run.frames[0].seconds = {0.25, 0, 0.125, 0.5};
    run.frames[2].seconds = {0.25, 0.5, 0.125, 0};
    CHECK(summary(run) ==
          "points   1,500 (most: 2,000 in frame 2)\n"
          "frames   3 in 0.500 s, 7,200 points a second\n"
          "seconds  graph 0.500, script 0.500, solve 0.250, write 0.500\n"
          "memory   3.0 MiB at the peak\n");
}

TEST_CASE("the summary adds up what solve warned of, and in which frames", "[report]")
{
    Recorded run = run_of({1, 1, 1, 1});
    CHECK_THAT(summary(run), !Catch::Contains("warning"));
    run.frames[1].contact_limit = 1000;
    run.frames[3].contact_limit = 234;
    run.frames[2].trapped = 1;
    CHECK_THAT(summary(run),
               Catch::EndsWith("at the peak\n"
                               "warning  points reached the limit of contacts 1,234 times, in 2 frames from 2 to 4\n"
                               "warning  points were deep in a shape once, in frame 3\n"));
}

TEST_CASE("the summary says what bands took that were built in the run, and nothing of others", "[report]")
{
    Recorded run = run_of({1, 1});
    run.frames[0].bands = {{"collide1", 0.06, 4000, 0}, {"collide2", 0.1, 5000, 0.25}};
    run.frames[1].bands = {{"collide1", 0.06, 4000, 0}, {"collide2", 0.2, 9000, 0.5}};
    CHECK_THAT(summary(run), Catch::EndsWith("at the peak\n"
                                             "band     of collide2: 0.2 m, 9,000 voxels at most, 0.750 s to build\n"));
}

TEST_CASE("the summary of an empty scene is one of no points, not of none run", "[report]")
{
    CHECK(summary(run_of({0, 0})).starts_with("points   0\nframes   2 in 0.500 s\n"));
    CHECK(summary(run_of({})).starts_with("points   none: no frame was run\n"));
}

TEST_CASE("the totals of a run tell what its frames tell, and writing is added behind them", "[report]")
{
    FrameResult result = frame_result();
    for (int i = 0; i <= 100; ++i) result.figures.error.values.push_back(i * 1e-4);
    result.figures.energy_drift.values = {0.5, -2, 0};
    result.figures.constraint_rows = 3;
    Recorded run = run_of({5, 1, 9, 2});
    for (int k = 0; k < 4; ++k) {
        result.frame = 10 + k;
        result.figures.constraint_residual_max = k == 2 ? 0.5 : 0.25;
        run.frames.push_back(statistics_of(result));
    }
    RunTotals totals;
    for (const FrameFigures& frame : run.frames) totals.add(frame);
    CHECK(summary(run, totals) == summary(run));
    CHECK_THAT(summary(run), Catch::Contains("residual of constraints: 5.0e-01 m at most (frame 12)"));

    totals.add_writing(0.75);
    run.frames.back().seconds.write += 0.75;
    CHECK(summary(run, totals) == summary(run));
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
}
