// Runs of a program that write files: the same files as `rapid run`, callbacks, cancelled and resumed runs, parts, and
// wrong options.
#include <atomic>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "bindings/scene/scene_inside.h"
#include "include/rapid/run.h"
#include "runtime/solver/figure_table.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using Catch::Contains, Catch::StartsWith;
using test::good;

const std::string cloud = R"(
local rapid = require "rapid"
local rate = rapid.param("rate", 2000, "particles born per second")
return rapid.create { fps = 24, seed = 3 }
  :emit { source = rapid.mesh.sphere { radius = 1, center = {0, 2, 0} }, rate = rate, birth = "random",
          life = {0.1, 0.6}, speed = 1, spread = 30, attributes = { heat = 1 } }
  :points("cool", function(p) p.heat = p.heat - p.dt end)
  :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.4 } :solve { substeps = 2 }
)";

std::string content(const fs::path& file)
{
    std::ifstream stream(file, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
}

RunOptions options(const test::TemporaryFolder& folder, RunFrames frames = {1, 8})
{
    RunOptions result;
    result.text = cloud;
    result.frames = frames;
    result.files.outputs = {folder / "cloud.####.csv"};
    return result;
}

// Records the callbacks of a run.
struct Reported {
    std::vector<RunFrame> frames;
    std::vector<std::string> lines, warnings;
    std::function<void(const RunFrame&)> on_frame;

    RunListener listener()
    {
        RunListener result;
        result.frame = [this](const RunFrame& frame) {
            frames.push_back(frame);
            if (on_frame) on_frame(frame);
        };
        result.line = [this](const std::string& text) { lines.push_back(text); };
        result.warning = [this](const std::string& text) { warnings.push_back(text); };
        return result;
    }
};

SceneRun made(RunOptions requested, RunListener listener = {}, SceneOptions scene = {})
{
    return good(SceneRun::make("cloud.lua", std::move(scene), std::move(requested), std::move(listener)));
}

RunOutcome outcome_of(SceneRun& run)
{
    good(run.prepare());
    return good(run.run());
}

RunOutcome complete(RunOptions requested, RunListener listener = {}, SceneOptions scene = {})
{
    SceneRun run = made(std::move(requested), std::move(listener), std::move(scene));
    RunOutcome outcome = outcome_of(run);
    if (outcome.error) FAIL(outcome.error->text());
    REQUIRE(outcome.ending == RunOutcome::Complete);
    return outcome;
}

void check_wrong(const RunOptions& requested, const std::string& message)
{
    const Result<SceneRun> run = SceneRun::make("cloud.lua", {}, requested);
    REQUIRE_FALSE(run);
    CHECK(run.error().kind == SceneError::WrongCall);
    CHECK_THAT(run.error().message, Contains(message));
}

void check_unprepared(const RunOptions& requested, const std::string& message,
                      SceneError::Kind kind = SceneError::WrongScene)
{
    SceneRun run = made(requested);
    const Result<Done> prepared = run.prepare();
    REQUIRE_FALSE(prepared);
    CHECK(prepared.error().kind == kind);
    CHECK_THAT(prepared.error().text(), Contains(message));
    CHECK_THAT(run.prepare().error().message, Contains("make a new one"));
    CHECK_FALSE(run.run());
    CHECK(run.first_frame() == 1);
}

}  // namespace

TEST_CASE("a run writes the points of the frames that a scene computes", "[run]")
{
    const test::TemporaryFolder folder;
    RunOptions requested = options(folder, {3, 7, 2});
    requested.statistics = folder / "statistics.json";
    requested.events = folder / "events.csv";
    requested.profile = folder / "profile.json";
    Reported reported;
    SceneRun run = made(requested, reported.listener());
    good(run.prepare());
    CHECK(run.first_frame() == 1);
    CHECK(run.frames().last == 7);
    CHECK_FALSE(fs::exists(requested.statistics));
    const RunOutcome outcome = good(run.run());
    CHECK(outcome.ending == RunOutcome::Complete);
    CHECK(outcome.last_frame == 7);
    CHECK_THAT(outcome.summary, StartsWith("points "));
    CHECK(reported.warnings.empty());
    REQUIRE(reported.lines.size() == 1);
    CHECK_THAT(reported.lines.front(), Contains("cloud.0003.csv"));

    Scene scene = test::opened(cloud);
    REQUIRE(reported.frames.size() == 7);
    for (std::int64_t number = 1; number <= 7; ++number) {
        const SceneFrame frame = good(scene.advance_to(number));
        const RunFrame& one = reported.frames[static_cast<std::size_t>(number - 1)];
        CHECK(one.number == number);
        CHECK(one.points == frame.size());
        CHECK_FALSE(one.is_known);
        const fs::path file = folder / ("cloud.000" + std::to_string(number) + ".csv");
        REQUIRE(fs::exists(file) == (number == 3 || number == 5 || number == 7));
        if (!fs::exists(file)) continue;
        good(frame.write(folder / "expected.csv"));
        CHECK(content(file) == content(folder / "expected.csv"));
    }
    const auto statistics = nlohmann::json::parse(content(requested.statistics));
    CHECK(statistics.at("frames").size() == 7);
    CHECK(statistics.at("graph") == "cloud.lua");
    CHECK_FALSE(nlohmann::json::parse(content(requested.profile)).empty());
    CHECK(good(SceneFrame::read(requested.events)).size() > 100);
}

TEST_CASE("a run that was ended goes on in another one to the same files", "[run]")
{
    const test::TemporaryFolder whole, parts;
    complete(options(whole));

    RunOptions requested = options(parts);
    requested.cache = {parts / "cache", 3};
    {
        Reported reported;
        SceneRun run = made(requested, reported.listener());
        reported.on_frame = [&](const RunFrame& frame) {
            if (frame.number == 5) run.end_after_frame();
        };
        const RunOutcome outcome = outcome_of(run);
        CHECK(outcome.ending == RunOutcome::Ended);
        CHECK(outcome.last_frame == 5);
        CHECK_FALSE(outcome.error);
        CHECK_FALSE(fs::exists(parts / "cloud.0006.csv"));
    }
    Reported reported;
    bool keeps = false;
    RunListener listener = reported.listener();
    listener.begins = [&](bool keeps_snapshots) { keeps = keeps_snapshots; };
    complete(requested, listener);
    CHECK(keeps);
    REQUIRE(reported.frames.size() == 8);
    for (const RunFrame& frame : reported.frames) CHECK(frame.is_known == (frame.number <= 5));
    for (int number = 1; number <= 8; ++number) {
        const std::string file = "cloud.000" + std::to_string(number) + ".csv";
        CHECK(content(whole / file) == content(parts / file));
    }

    // A run with other values does not take over the folder unless it is told to replace it.
    SceneOptions other;
    other.set = {{"rate", 1000.0}};
    {
        SceneRun refused = made(requested, {}, other);
        good(refused.prepare());
        const Result<RunOutcome> outcome = refused.run();
        REQUIRE_FALSE(outcome);
        CHECK_THAT(outcome.error().message, Contains("rate was 2000, is 1000"));
    }
    requested.cache.replace = true;
    complete(requested, {}, other);
}

TEST_CASE("the statistics of a frame have every figure of the table, also if a cache has the frame", "[run]")
{
    std::set<std::string> figures;
#define RAPID_FIGURE(type, name, together, later, reported, ...) \
    if (std::string(#reported) != "false") figures.insert(#name);
    RAPID_FIGURES(RAPID_FIGURE)
#undef RAPID_FIGURE
    figures.insert("error_by_source");  // computed from the plan and other figures (report/error_budget.h)
    const test::TemporaryFolder folder;
    RunOptions requested = options(folder, {1, 2});
    requested.text = test::every_figure;
    requested.statistics = folder / "statistics.json";
    requested.cache.folder = folder / "cache";
    std::vector<nlohmann::json> frames;
    for (const bool is_known : {false, true}) {
        Reported reported;
        complete(requested, reported.listener());
        for (const RunFrame& frame : reported.frames) CHECK(frame.is_known == is_known);
        frames.push_back(nlohmann::json::parse(content(requested.statistics)).at("frames"));
    }
    std::set<std::string> keys;
    for (const auto& [key, value] : frames[0].at(1).items()) keys.insert(key);
    CHECK(keys == figures);
    CHECK(frames[0] == frames[1]);
}

TEST_CASE("a run without a cache also ends after its current frame", "[run]")
{
    const test::TemporaryFolder folder;
    SceneRun run = made(options(folder));
    run.end_after_frame();
    const RunOutcome outcome = outcome_of(run);
    CHECK(outcome.ending == RunOutcome::Ended);
    CHECK(outcome.last_frame == 1);
    CHECK(fs::exists(folder / "cloud.0001.csv"));
    CHECK_FALSE(fs::exists(folder / "cloud.0002.csv"));
}

TEST_CASE("the parts of a run have the points of the whole", "[run]")
{
    const test::TemporaryFolder folder;
    complete(options(folder));
    const SceneFrame whole = good(SceneFrame::read(folder / "cloud.0008.csv"));
    std::size_t points = 0;
    for (int number = 1; number <= 3; ++number) {
        RunOptions requested = options(folder);
        requested.part = {number, 3};
        complete(requested);
        points += good(SceneFrame::read(folder / ("cloud_part" + std::to_string(number) + "of3.0008.csv"))).size();
    }
    REQUIRE(whole.size() > 100);
    CHECK(points == whole.size());

    RunOptions sampled = options(folder);
    sampled.sample = 0.5;
    sampled.files.outputs = {folder / "half.####.csv"};
    complete(sampled);
    const auto half = static_cast<double>(good(SceneFrame::read(folder / "half.0008.csv")).size());
    CHECK(half == Approx(0.5 * static_cast<double>(whole.size())).epsilon(0.2));

    SceneRun run = made(options(folder));
    CHECK_THAT(SceneInside::merges(run, 3).error().message, Contains("call prepare() first"));
    good(run.prepare());
    const auto merges = good(SceneInside::merges(run, 3));
    REQUIRE(merges.size() == 1);
    CHECK(merges.front().first == (folder / "cloud.####.csv"));
    CHECK(merges.front().second == (folder / "cloud_part{part}.####.csv"));
    CHECK_THAT(SceneInside::merges(run, 0).error().message, Contains("parts = 0; it must be from 1"));
    good(run.run());  // still for all points
    CHECK(good(SceneFrame::read(folder / "cloud.0008.csv")).size() == whole.size());
}

TEST_CASE("a frame that fails ends a run, and those before it are written", "[run]")
{
    const test::TemporaryFolder folder;
    RunOptions requested = options(folder);
    requested.text = R"(local rapid = require "rapid"
return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 1000 }
  :points("late", function(p) if p.age > 0.15 then error("too old") end end) :solve {})";
    requested.statistics = folder / "statistics.json";
    SceneRun run = made(requested);
    const RunOutcome outcome = outcome_of(run);
    CHECK(outcome.ending == RunOutcome::Failed);
    REQUIRE(outcome.error);
    CHECK(outcome.error->kind == SceneError::FailedFrame);
    CHECK(outcome.error->node == "late");
    CHECK(outcome.error->line == 3);
    CHECK(outcome.unwritten.empty());
    REQUIRE(outcome.last_frame >= 2);
    for (std::int64_t number = 1; number <= outcome.last_frame; ++number)
        CHECK(fs::exists(folder / ("cloud.000" + std::to_string(number) + ".csv")));
    CHECK(nlohmann::json::parse(content(requested.statistics)).at("frames").size() ==
          static_cast<std::size_t>(outcome.last_frame));

    const Result<RunOutcome> again = run.run();
    REQUIRE_FALSE(again);
    CHECK_THAT(again.error().message, Contains("the run is already complete"));
}

TEST_CASE("a run is cancelled from another thread", "[run]")
{
    const test::TemporaryFolder folder;
    RunOptions requested = options(folder, {1, 100000});
    requested.files.outputs.clear();
    std::atomic<std::int64_t> frame = 0;
    RunListener listener;
    listener.frame = [&](const RunFrame& one) { frame = one.number; };
    SceneRun run = made(requested, listener);
    std::thread other([&] {
        while (frame < 3) std::this_thread::yield();
        run.cancel();
    });
    const RunOutcome outcome = outcome_of(run);
    other.join();
    CHECK(outcome.ending == RunOutcome::Failed);
    REQUIRE(outcome.error);
    CHECK(outcome.error->kind == SceneError::Cancelled);
    CHECK(outcome.last_frame >= 3);
}

TEST_CASE("a run is abandoned between two frames, or not at all", "[run]")
{
    const test::TemporaryFolder folder;
    RunOptions requested = options(folder);
    requested.statistics = folder / "statistics.json";
    Reported reported;
    SceneRun run = made(requested, reported.listener());
    bool is_abandoned = true;
    reported.on_frame = [&](const RunFrame& frame) {  // during a callback
        if (frame.number == 3) std::thread([&] { is_abandoned = SceneInside::abandon(run).has_value(); }).join();
        if (frame.number == 4) run.end_after_frame();
    };
    CHECK(outcome_of(run).last_frame == 4);
    CHECK_FALSE(is_abandoned);

    requested.statistics = folder / "abandoned.json";
    SceneRun prepared = made(requested);
    good(prepared.prepare());
    const std::optional<Abandoned> abandoned = SceneInside::abandon(prepared);
    REQUIRE(abandoned);
    CHECK(abandoned->unwritten.empty());
    CHECK(nlohmann::json::parse(content(requested.statistics)).at("frames").empty());
}

TEST_CASE("what can't be a run is refused before a file is opened", "[run]")
{
    const test::TemporaryFolder folder;
    const RunOptions right = options(folder);
    CHECK_FALSE(SceneRun::make("", {}, right));
    const auto wrong = [&](const auto& change, const std::string& message) {
        RunOptions requested = right;
        change(requested);
        check_wrong(requested, message);
    };
    wrong([](RunOptions& o) { o.frames = RunFrames{1, 4, 0}; }, "frames 1-4x0");
    wrong([](RunOptions& o) { o.frames = RunFrames{4, 1}; }, "frames 4-1x1");
    wrong([](RunOptions& o) { o.part = {3, 2}; }, "part 3 of 2");
    wrong([](RunOptions& o) { o.part = {1, 0}; }, "part 1 of 0");
    wrong([](RunOptions& o) { o.sample = 0; }, "sample = 0");
    wrong([](RunOptions& o) { o.sample = NAN; }, "sample = nan");
    wrong([](RunOptions& o) { o.cache.every = -1; }, "every = -1");
    wrong([](RunOptions& o) { o.cache.again = true; }, "again replaces the contents of a cache");
    wrong([](RunOptions& o) { o.claims = "claims"; }, "claims need a statistics file");
    wrong(
        [](RunOptions& o) {
            o.files.pictures.camera.position = {1, NAN, 0};
        },
        "the camera's position and target must be finite");
    wrong(
        [](RunOptions& o) {
            o.files.pictures.camera.position = o.files.pictures.camera.target = {1, 2, 3};
        },
        "the camera\'s position and target are equal");
    wrong([](RunOptions& o) { o.files.pictures.size = {0, 10}; }, "a picture of 0x10");
    wrong([](RunOptions& o) { o.files.pictures.size.width = 1 << 20; }, "a picture of 1048576x720");
    wrong([](RunOptions& o) { o.files.pictures.camera.fov = 180; }, "fov = 180");
    SceneOptions scene;
    scene.threads = -1;
    CHECK_FALSE(SceneRun::make("cloud.lua", scene, right));
    scene.threads = 0;
    scene.nodes.emplace_back();
    RunOptions cached = right;
    cached.cache.folder = folder / "cache";
    const Result<SceneRun> offering = SceneRun::make("cloud.lua", scene, cached);
    REQUIRE_FALSE(offering);
    CHECK_THAT(offering.error().message,
               Contains("a cache can't see changes of the objects and nodes that the program offers"));
    CHECK(fs::is_empty(folder.path()));
}

TEST_CASE("mistakes in a scene and its files are found before the first frame", "[run]")
{
    const test::TemporaryFolder folder;
    const RunOptions right = options(folder);
    const auto wrong = [&](const auto& change, const std::string& message) {
        RunOptions requested = right;
        change(requested);
        check_unprepared(requested, message);
    };
    wrong([](RunOptions& o) { o.text = "local rapid = require 'rapid'\nreturn rapid.creat {}"; }, "cloud.lua:2: ");
    wrong([](RunOptions& o) { o.text = std::nullopt; }, "cloud.lua");
    wrong([&](RunOptions& o) { o.files.outputs = {folder / "cloud.csv"}; }, "several frames would go into one file");
    wrong([&](RunOptions& o) { o.files.outputs = {folder / "cloud.####.xyz"}; }, "xyz");
    wrong([&](RunOptions& o) { o.files.outputs = {folder / "cloud.####.csv:heet"}; }, "heet");
    wrong([&](RunOptions& o) { o.files.outputs.push_back(o.files.outputs.front()); }, "written twice");
    wrong([&](RunOptions& o) { o.statistics = o.profile = folder / "one.json"; }, "one.json");
    wrong([](RunOptions& o) { o.frames = RunFrames{0, 4}; }, "before the scene's first");
    wrong(
        [](RunOptions& o) {
            o.text = R"(local rapid = require "rapid"
return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 10 } :contact { radius = 0.1 } :solve {})";
            o.part = {1, 2};
        },
        "contact");
    CHECK(fs::is_empty(folder.path()));

    SceneRun run = made(right);
    CHECK_THAT(run.run().error().message, Contains("call prepare() first"));
    good(run.prepare());
    CHECK_THAT(run.prepare().error().message, Contains("the run is already prepared"));
}

TEST_CASE("advice that takes too long is dropped, and the scene still runs", "[run]")
{
    SceneOptions options;
    options.script_seconds = 0.2;
    Scene scene = test::opened(R"(local rapid = require "rapid"
local n = rapid.param("n", 1e12)
return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 1000 }
  :points("long", function(p) for i = 1, n do p.v = p.v * 0.5 end end) :drag { linear = 5000 } :solve {})",
                               options);
    CHECK(good(SceneInside::advice_on(scene, {})).empty());
    good(scene.set("n", 1.0));
    CHECK_THAT(good(SceneInside::advice_on(scene, {})), Contains("drag1"));
    CHECK(good(scene.advance()).number() == 1);
}

TEST_CASE("runs at once do not write one file of a node", "[run]")
{
    const test::TemporaryFolder folder;
    fs::create_directory(folder / "claims");
    RunOptions requested = options(folder);
    requested.text = R"(local rapid = require "rapid"
return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 10 } :solve {}
  :write { file = ")" +
                     (folder / "node.####.csv").string() + R"(" })";
    requested.files.outputs.clear();
    requested.claims = folder / "claims";
    requested.statistics = folder / "a.json";
    complete(requested);
    requested.statistics = folder / "b.json";
    check_unprepared(requested, "node.####.csv");
}

TEST_CASE("formats and folders of outputs are known without a scene", "[run]")
{
    const test::TemporaryFolder folder;
    CHECK(good(SceneInside::output_format("a.####.vdb:heat")).extension == ".vdb");
    CHECK_FALSE(good(SceneInside::output_format("a.####.vdb")).is_film);
    CHECK(good(SceneInside::output_format("a.mp4")).is_film);
    CHECK_FALSE(SceneInside::output_format("a.####.xyz"));
    CHECK(SceneInside::output_formats().size() >= 13);
    for (const OutputFormat& format : SceneInside::output_formats())
        CHECK(good(SceneInside::output_format("a.####" + format.extension)).is_film == format.is_film);

    RunOptions requested = options(folder);
    requested.files.outputs = {folder / "points/{output}/a.####.csv", folder / "b.####.csv"};
    requested.statistics = folder / "told/s.json";
    requested.cache.folder = folder / "cache";
    const std::vector<std::string> folders = good(SceneInside::output_folders(requested));
    CHECK(folders == std::vector<std::string>{folder / "points", folder.path(), folder / "told", folder / "cache"});
    for (const std::string& one : folders) CHECK(fs::is_directory(one));
    requested.part = {2, 4};
    requested.files.outputs = {folder / "{part}/a.####.csv"};
    requested.statistics = folder / "told{part}/s.json";
    requested.claims = folder / "claims";
    CHECK(good(SceneInside::output_folders(requested)) ==
          std::vector<std::string>{folder / "2of4", folder / "told2of4", folder / "cache", folder / "claims"});
    CHECK(fs::is_directory(folder / "told2of4"));
    CHECK_FALSE(fs::exists(folder / "told{part}"));
    requested.files.outputs = {"/proc/none/a.####.csv"};
    CHECK_FALSE(SceneInside::output_folders(requested));
}

TEST_CASE("the attributes that a plan keeps for files are explained", "[run]")
{
    Scene scene = test::opened(cloud);
    FileOutputs files;
    const SceneReport all = good(SceneInside::explain_outputs(scene, files));
    CHECK(all.text == good(scene.explain()).text);
    files.outputs = {"a.####.csv:v"};
    const SceneReport some = good(SceneInside::explain_outputs(scene, files));
    CHECK(some.text != all.text);
    CHECK_FALSE(nlohmann::json::parse(some.json).empty());
    files.outputs = {"a.####.csv:heet"};
    CHECK_THAT(SceneInside::explain_outputs(scene, files).error().message, Contains("did you mean"));

    files.outputs.clear();
    Scene other = test::opened(cloud + ":drag { linear = 1 }", {}, "other.lua");
    const SceneReport more = good(SceneInside::explain_difference(scene, files, other));
    CHECK_THAT(more.text, Contains("cloud.lua") && Contains("other.lua") && Contains("drag"));
    CHECK(nlohmann::json::parse(more.json).at("against") == "other.lua");
    CHECK_FALSE(SceneInside::explain_difference(scene, files, scene));

    good(scene.advance());
    const auto state = nlohmann::json::parse(good(SceneInside::explain_state(scene, files, 4)).json);
    CHECK(state.at("frame") == 4);
    CHECK(state.at("simulations").at("create1").get<std::size_t>() > 0);
    CHECK_THAT(SceneInside::explain_state(scene, files, 0).error().message, Contains("before the scene's first"));
    CHECK(good(scene.advance()).number() == 2);
}

TEST_CASE("a scene is checked without a frame, and for kernels that remember", "[run]")
{
    Scene scene = test::opened(cloud);
    good(scene.advance());
    CHECK_THAT(
        good(SceneInside::check_outputs(scene, {})),
        StartsWith("param rate = 2000  particles born per second\ncloud.lua: OK, ") && Contains("to output main"));
    CHECK(good(SceneInside::advice_on(scene, {})).empty());
    const SceneRaces none = good(SceneInside::find_races(scene, {}, {2, 4}));
    CHECK_FALSE(none.found);
    CHECK(none.compared);
    CHECK_FALSE(good(SceneInside::find_races(scene, {}, {1, 1})).compared);
    CHECK_FALSE(SceneInside::find_races(scene, {}, {0, 0}));
    CHECK_FALSE(SceneInside::find_races(scene, {}, {1, 4, 0}));
    CHECK(good(scene.advance()).number() == 2);

    Scene stiff = test::opened(R"(local rapid = require "rapid"
return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 1000, velocity = {0, 1, 0} } :drag { linear = 5000 } :solve {})");
    CHECK_THAT(good(SceneInside::advice_on(stiff, {})), Contains("drag1"));

    // A table inside another table of the kernel is not followed, and large ones are not compared.
    Scene remembers = test::opened(R"(local rapid = require "rapid"
local box = { n = 0 }
ballast = {}
for i = 1, 20000 do ballast[i] = i end
return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 1000, attributes = { heat = 0 } }
  :points("count", function(p) local held = { box } local kept = held[1] kept.n = kept.n + 1 p.heat = kept.n end) :solve {})");
    const SceneRaces races = good(SceneInside::find_races(remembers, {}, {2, 4}));
    REQUIRE(races.found);
    CHECK(races.found->node == "count");
    CHECK_THAT(races.found->message, Contains("a kernel must not remember other points"));
}

}  // namespace rapid
