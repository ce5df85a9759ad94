// Reports about a scene: its graph, the lives of points, slow scripts, and the position of an error in a script.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>

#include "bindings/scene/installation.h"
#include "bindings/scene/scene_inside.h"
#include "include/rapid/scene.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains, Catch::StartsWith;
using test::good;

Scene opened(const std::string& text, SceneOptions options = {})
{
    return test::opened("local rapid = require 'rapid'\n" + text, std::move(options), "told.lua");
}

const char* const ball =
    "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {5, 1, 0}}, life = {0.5, 9} } }"
    ":gravity {} :collide { name = 'floor', shape = rapid.shape.plane {}, bounce = 0.5 } :solve {}";

float height(const SceneFrame& frame, std::size_t i) { return frame.column("P")->at<float>(i)[1]; }

}  // namespace

TEST_CASE("what scenes are made of is documented without a scene", "[reports]")
{
    const NodeDocuments documents = good(SceneInside::documents());
    CHECK(documents.types.size() > 40);
    CHECK(std::is_sorted(documents.types.begin(), documents.types.end(),
                         [](const auto& a, const auto& b) { return a.name < b.name; }));
    const auto gravity = std::find_if(documents.types.begin(), documents.types.end(),
                                      [](const NodeDocument& type) { return type.name == "gravity"; });
    REQUIRE(gravity != documents.types.end());
    CHECK_THAT(gravity->page.text, StartsWith(":gravity{...}\n") && Contains("default {0, -9.81, 0}"));
    CHECK_THAT(gravity->page.json,
               StartsWith(R"({"name":"gravity","doc":)") && Contains(R"("default":[0.0,-9.81,0.0])"));
    CHECK_THAT(documents.annotations, StartsWith("---@meta") && Contains("function Node:gravity(params) end"));
}

TEST_CASE("the types that every scene may use are listed without one", "[reports]")
{
    const std::vector<SceneNodeType> types = good(SceneInside::all_node_types());
    const auto has = [&](const char* name) {
        return std::any_of(types.begin(), types.end(), [&](const SceneNodeType& type) { return type.name == name; });
    };
    CHECK(has("gravity"));  // native
    CHECK(has("lift"));     // in Lua
    CHECK_FALSE(has("lfit"));
    CHECK(std::is_sorted(types.begin(), types.end(), [](const auto& a, const auto& b) { return a.name < b.name; }));
}

TEST_CASE("Rapid's own files are where it says, and all of the library is loaded on request", "[reports]")
{
    const Installation installation = good(Installation::find());
    CHECK(std::filesystem::exists(std::filesystem::path(installation.lua) / "rapid.d.lua"));
    CHECK(std::filesystem::exists(std::filesystem::path(installation.lua) / "new/scene.lua"));
    CHECK(std::filesystem::is_directory(installation.library));
    good(Installation::load_all());
    good(Installation::load_all());
}

TEST_CASE("a plan lists what it keeps and prunes", "[reports]")
{
    Scene scene = opened(
        "rapid.create { name = 'spare' } :drag { linear = 1 }\n"
        "return rapid.create {} :attribute { heat = 1 } :gravity { name = 'down' } :solve {}");
    const SceneReport report = good(scene.explain());
    CHECK_THAT(report.json, StartsWith(R"({"nodes":[{"name":"create2","type":"create","kept":true,)"));
    CHECK_THAT(report.json, Contains(R"("name":"spare","type":"create","kept":false)"));
    CHECK_THAT(report.json, Contains(R"({"name":"heat","simulation":"create2","kept":true,"bytes_per_point":4,)"));
    CHECK_THAT(report.text, StartsWith("KEPT\n nodes\n") && Contains("PRUNED") && Contains("spare"));
}

TEST_CASE("the points after a node are those before it, changed by its formula", "[reports]")
{
    Scene scene = opened(
        "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {5, 1, 0}} } } :attribute { heat = 2 }"
        ":points('warm', function(p) p.heat = p.heat * 3 end) :points('cull', function(p) if p.id == 1 then p:kill() "
        "end "
        "end) :gravity {} :solve {} :points('later', function(p) p.heat = 0 end)");
    const float height_before = height(good(scene.advance_to(3)), 0);
    const SceneFrame warm = good(scene.points_after("warm", 3));
    CHECK(warm.outputs() == std::vector<std::string>{"warm"});
    CHECK(warm.number() == 3);
    CHECK(warm.time() == Approx(2 / 24.0));
    CHECK(warm.fps() == 24);
    REQUIRE(warm.size() == 1);  // the other one died in frame 2
    CHECK(*warm.column("heat")->at<float>(0) == 18);
    CHECK(good(scene.points_after("warm", 2)).size() == 2);
    CHECK(good(scene.points_after("cull", 2)).size() == 1);
    CHECK(*good(scene.points_after("solve1", 3)).column("heat")->at<float>(0) == 18);
    CHECK(*good(scene.points_after("later", 3)).column("heat")->at<float>(0) == 0);
    CHECK_THAT(good(scene.picture(warm)), StartsWith("\x89PNG"));
    CHECK(scene.next_frame() == 1);
    CHECK(height(good(scene.advance_to(3)), 0) == height_before);
}

TEST_CASE("points after a missing node, or before the first frame, are an error", "[reports]")
{
    Scene scene = opened(
        "rapid.create { name = 'spare' } :drag { linear = 1 }\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } }\n"
        ":points('warm', function(p, frame) if frame.number == 4 then error 'hot' end end) :solve {}");
    const auto fault = [&](const char* node, std::int64_t frame) {
        const Result<SceneFrame> points = scene.points_after(node, frame);
        REQUIRE_FALSE(points);
        return points.error();
    };
    CHECK_THAT(fault("worm", 2).message, Contains("did you mean \"warm\""));
    CHECK_THAT(fault("spare", 2).message, Contains("node \"spare\" is pruned: it leads to no output"));
    CHECK_THAT(fault("warm", 0).message, Contains("before the scene's first"));
    CHECK(fault("worm", 2).kind == SceneError::WrongCall);
    const SceneError late = fault("solve1", 5);
    CHECK(late.kind == SceneError::FailedFrame);
    CHECK(late.line == 4);
    CHECK(good(scene.advance_to(3)).size() == 1);
}

TEST_CASE("the profile of a frame adds up to no more than its time", "[reports]")
{
    Scene scene = opened(ball);
    const SceneFrame frame = good(scene.advance_to(3));
    const std::string json = frame.profile_json();
    CHECK_THAT(json, StartsWith("[{\"nodes\":[\"") && Contains(R"("nodes":["solve1"],"stage":"solve","begin":)"));
    const std::string mark = "\"seconds\":";
    double sum = 0;
    for (std::size_t at = json.find(mark); at != std::string::npos; at = json.find(mark, at + 1))
        sum += std::stod(json.substr(at + mark.size()));
    CHECK(sum > 0);
    CHECK(sum <= frame.statistics().seconds);
}

TEST_CASE("the graph of a scene has its nodes, and an edge back from Solve", "[reports]")
{
    Scene scene = opened(
        "rapid.create { name = 'spare' } :drag { linear = 1 }\n"
        "return rapid.create {} :gravity { name = 'down' } :solve {}");
    const std::string dot = good(scene.graph(GraphForm::Dot));
    CHECK_THAT(dot, StartsWith("digraph") && Contains("down") && Contains("n2 -> n0") && Contains("spare"));
    CHECK_THAT(good(scene.graph(GraphForm::Svg)), Contains("<svg") && Contains("down"));
    const std::string json = good(scene.graph(GraphForm::Json));
    CHECK_THAT(json, Contains(R"("name":"down","type":"gravity")") && Contains(R"("x":)"));
    CHECK_THAT(json, Contains(R"("why":"leads to no output")"));
    CHECK(scene.graph(static_cast<GraphForm>(7)).error().kind == SceneError::WrongCall);
    CHECK(good(scene.advance()).number() == 1);  // inspection does not disturb the scene
}

TEST_CASE("the graph of a scene whose frame failed is there", "[reports]")
{
    Scene scene = opened(
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }"
        ":points('fails', function(p) error 'no more' end) :solve {}");
    REQUIRE_FALSE(scene.advance_to(3));
    CHECK_THAT(good(scene.graph(GraphForm::Dot)), Contains("fails"));
}

TEST_CASE("a life has birth, contacts and death at the moments of the formula", "[reports]")
{
    Scene scene = opened(ball);
    const SceneTrace trace = good(scene.trace({{0, 77}, "", 1, 24, 1}));
    CHECK(trace.unborn == std::vector<std::int64_t>{77});
    CHECK_FALSE(trace.fault);
    const std::string& json = trace.lives.json;
    CHECK_THAT(json, StartsWith(R"([{"id":0,"simulation":"create1","birth":{"frame":1,"time":0.0,"P":[0.0,1.0,0.0])"));
    const std::size_t contact = json.find(R"({"node":"floor","time":)");
    REQUIRE(contact != std::string::npos);
    CHECK(std::stod(json.substr(contact + 23)) == Approx(std::sqrt(2 / 9.81)).epsilon(1e-6));
    CHECK_THAT(json, Contains(R"("death":{"frame":13,"time":0.5)"));
    CHECK_THAT(trace.lives.text, StartsWith("point 0 of create1\n") && Contains("its life ended"));
}

TEST_CASE("only the requested frames are traced", "[reports]")
{
    Scene scene = opened(ball);
    const std::string json = good(scene.trace({{1}, "create1", 3, 9, 3})).lives.json;
    for (int frame = 2; frame <= 10; ++frame) {
        const bool is_told = json.find(R"({"frame":)" + std::to_string(frame) + R"(,"time")") != std::string::npos;
        CHECK(is_told == (frame % 3 == 0));
    }
}

TEST_CASE("after a trace a scene is at its start, and its frames are bit-identical to before", "[reports]")
{
    Scene scene = opened(ball);
    const float before = height(good(scene.advance_to(7)), 1);
    good(scene.trace({{0}, "", 1, 30, 1}));
    CHECK(scene.next_frame() == scene.first_frame());
    CHECK(height(good(scene.advance_to(7)), 1) == before);
}

TEST_CASE("a wrong trace is an error, and one that fails half-way returns the frames before", "[reports]")
{
    Scene scene = opened(ball);
    CHECK_THAT(scene.trace({{0}, "creat1", 1, 9, 1}).error().message, Contains("did you mean \"create1\""));
    CHECK_THAT(scene.trace({{0}, "", 1, 0, 1}).error().message, Contains("frames 1 to 0 end before they begin"));
    CHECK_THAT(scene.trace({{0}, "", -1, 0, 1}).error().message, Contains("before the scene's first"));
    CHECK_THAT(scene.trace({{0}, "", 1, 9, 0}).error().message, Contains("step = 0"));
    CHECK_THAT(scene.trace({{}, "", 1, 2, 1}).error().message, Contains("there are no ids"));

    Scene failing = opened(
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }\n"
        ":points('fails', function(p, frame) if frame.number == 3 then error 'no more' end end)"
        ":solve {}");
    const SceneTrace trace = good(failing.trace({{0}, "", 1, 9, 1}));
    REQUIRE(trace.fault);
    CHECK(trace.fault->kind == SceneError::FailedFrame);
    CHECK(trace.fault->line == 3);
    CHECK_THAT(trace.fault->script_stack, Contains("told.lua:3"));
    CHECK_THAT(trace.lives.json, Contains(R"({"frame":2,"time")"));
    CHECK(failing.next_frame() == 1);
    CHECK(good(failing.advance_to(2)).number() == 2);
}

TEST_CASE("a trace is cancelled, and refused within another call", "[reports]")
{
    SceneError::Kind inside{};
    Scene* self = nullptr;
    SceneOptions options;
    options.log = [&](LogLevel, const std::string&) {
        if (!self) return;
        inside = self->trace({{0}, "", 1, 2, 1}).error().kind;
        self->cancel();
    };
    Scene scene = opened(
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }"
        ":detail('told', function(points, frame) print(frame.number) end) :solve {}",
        options);
    self = &scene;
    CHECK(scene.trace({{0}, "", 1, 50, 1}).error().kind == SceneError::Cancelled);
    CHECK(inside == SceneError::Busy);
    self = nullptr;
    CHECK_THAT(scene.advance().error().message, Contains("call restart()"));
    good(scene.restart());
    good(scene.advance());
    CHECK(good(scene.trace({{0}, "", 1, 5, 1})).lives.text.size() > 10);
}

TEST_CASE("an error has the calls of the script in which it was raised", "[reports]")
{
    const Result<Scene> wrong = Scene::open_text("deep.lua",
                                                 "local function inner() error 'here' end\n"
                                                 "local function outer() inner(); return 1 end\nouter()\n");
    REQUIRE_FALSE(wrong);
    const std::string& stack = wrong.error().script_stack;
    CHECK(stack.find("deep.lua:1") < stack.find("deep.lua:2"));
    CHECK(stack.find("deep.lua:2") < stack.find("deep.lua:3"));
    const Result<Scene> unnamed = Scene::open("");
    REQUIRE_FALSE(unnamed);
    CHECK(unnamed.error().script_stack.empty());
}

TEST_CASE("a program is notified of a slow script before it is stopped", "[reports]")
{
    const test::TemporaryFolder folder;
    const std::string file = folder.write("late.lua", "while true do end");
    SceneOptions options;
    options.script_seconds = 0.2;
    std::atomic<int> reported = 0;
    std::string text;
    SceneHooks hooks;
    hooks.on_script_timeout = [&](const std::string& message) {
        if (reported++ == 0) text = message;
        throw 1;  // ignored
    };
    const Result<Scene> scene = SceneInside::open(file, options, hooks);
    REQUIRE_FALSE(scene);
    CHECK(scene.error().kind == SceneError::TooLong);
    CHECK(reported >= 1);
    CHECK_THAT(text, Contains("ran for more than 0.2 s"));
}

TEST_CASE("a program is notified of each file before a scene reads it", "[reports]")
{
    const test::TemporaryFolder folder;
    folder.write("speed.lua", "return 3");
    const std::string file = folder.write("read.lua", R"(local rapid = require "rapid"
return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 10, speed = require "speed" } :solve {})");
    std::vector<std::string> read;
    SceneHooks hooks;
    hooks.on_file_read = [&](const std::string& path) {
        read.push_back(path);
        throw 1;  // ignored
    };
    good(SceneInside::open(file, {}, hooks));
    CHECK(std::any_of(read.begin(), read.end(), [](const std::string& path) { return path.ends_with("speed.lua"); }));
}

TEST_CASE("points have their errors, substeps and sleep if a program requests them", "[reports]")
{
    const test::TemporaryFolder folder;
    const std::string file = folder.write("told.lua", R"(local rapid = require "rapid"
return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = 1000 } :gravity {} :solve { substeps = 3 })");
    SceneHooks hooks;
    hooks.per_point_diagnostics = true;
    Scene scene = good(SceneInside::open(file, {}, hooks));
    const SceneFrame frame = good(scene.advance_to(4));
    REQUIRE(frame.size() > 100);
    for (const char* const name : {"error", "substeps", "asleep"}) CHECK(frame.column(name));
    CHECK_FALSE(good(good(Scene::open(file)).advance_to(4)).column("substeps"));
}

TEST_CASE("a scene that is to be kept refuses what no snapshot holds", "[reports]")
{
    const test::TemporaryFolder folder;
    const std::string file = folder.write("counts.lua", R"(local rapid = require "rapid"
local count = 0
return rapid.create {} :emit { source = rapid.mesh.sphere {}, rate = function() count = count + 1 return count end }
  :solve {})");
    SceneHooks hooks;
    hooks.keep_state = true;
    CHECK_FALSE(SceneInside::open(file, {}, hooks));
    CHECK(Scene::open(file));
}

}  // namespace rapid
