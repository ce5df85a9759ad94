// Scenes in a program (rapid/scene.h): bit-identical to a session, memory that is shared and stays unchanged, errors as
// values, and a scene that stays usable after each error.
#include "bindings/scene/scene_inside.h"
#include "include/rapid/scene.h"

#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <stop_token>
#include <thread>

#include "include/rapid/shapes.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains, Catch::EndsWith, Catch::StartsWith;
using test::TemporaryFolder, test::good, test::opened;

// A cloud changed by kernels, births, deaths and a floor, with P, v, id, age, life, heat, the group "hot", and a detail
// value.
const std::string cloud = R"(
local rapid = require "rapid"
local rate = rapid.param("rate", 20000, "particles born per second")
local name = rapid.param("name", "cloud", "shown")
local wind = rapid.param("wind", {1, 0, 0}, "where it goes")
return rapid.create { fps = 24, seed = 3 }
  :emit { source = rapid.mesh.sphere { radius = 1, center = {0, 2, 0} }, rate = rate, birth = "random",
          life = {0.1, 0.6}, speed = 1, spread = 30, attributes = { heat = 1, shade = 0.25 } }
  :points("cool", function(p)
    p.v = p.v + wind * p.dt
    p.heat = p.heat * math.exp(-p.dt) * (0.5 + p:rand(1))
    if p.heat < 0.6 then p:join "hot" end
  end)
  :detail("mean", function(points) points.detail.count = #points end)
  :gravity {}
  :collide { shape = rapid.shape.plane {}, bounce = 0.4 }
  :solve { substeps = 2 }
)";

// Returns all values of a frame as text of their bits.
std::string bits_of(const SceneFrame& frame)
{
    std::string bits;
    const auto add = [&](const SceneColumn& column) {
        const std::size_t bytes = column.components * (column.type == ColumnType::Int64   ? 8
                                                       : column.type == ColumnType::UInt8 ? 1
                                                                                          : 4);
        bits += column.name;
        for (std::size_t i = 0; i < column.count; ++i)
            bits.append(static_cast<const char*>(column.data) + i * column.stride, bytes);
    };
    for (const std::string& name : frame.columns()) add(*frame.column(name));
    for (const std::string& name : frame.groups()) add(*frame.group(name));
    return bits;
}

std::string run(Scene& scene, std::int64_t frame) { return bits_of(good(scene.advance_to(frame))); }

}  // namespace

TEST_CASE("points fall as the formula says", "[scene]")
{
    Scene scene = opened(
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.grid { size = {1, 0, 1}, center = {0, 10, 0} } }"
        ":gravity {} :solve {}");
    for (int number = 1; number <= 25; ++number) {
        const SceneFrame frame = good(scene.advance());
        REQUIRE(frame.number() == number);
        REQUIRE(frame.size() == 100);
        REQUIRE(frame.columns() == std::vector<std::string>{"P", "id", "v"});
        const double t = (number - 1) / 24.0;
        CHECK(frame.time() == Approx(t));
        const SceneColumn P = *frame.column("P"), id = *frame.column("id");
        for (std::size_t i = 0; i < 100; ++i) {
            REQUIRE(P.at<float>(i)[1] == Approx(10 - 9.81 / 2 * t * t).epsilon(1e-6));
            REQUIRE(*id.at<std::int64_t>(i) == static_cast<std::int64_t>(i));
        }
    }
}

TEST_CASE("groups and detail values are read", "[scene]")
{
    Scene scene = opened(cloud);
    const SceneFrame frame = good(scene.advance_to(6));
    REQUIRE(frame.groups() == std::vector<std::string>{"hot"});
    const SceneColumn hot = *frame.group("hot"), heat = *frame.column("heat");
    REQUIRE(hot.type == ColumnType::UInt8);
    int members = 0;
    for (std::size_t i = 0; i < frame.size(); ++i) {
        REQUIRE((*hot.at<std::uint8_t>(i) == 1) == (*heat.at<float>(i) < 0.6f));
        members += *hot.at<std::uint8_t>(i);
    }
    CHECK(members > 0);
    CHECK(std::get<double>(good(frame.detail("count"))) > 0);
}

TEST_CASE("a column of strings contains tokens, which give the strings", "[scene]")
{
    Scene scene = opened(
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {1, 0, 0}}, name = {'leaf', ''} } } :solve "
        "{}");
    const SceneFrame frame = good(scene.advance());
    const SceneColumn name = *frame.column("name");
    REQUIRE(name.type == ColumnType::String);
    CHECK(good(SceneFrame::text_of(*name.at<std::uint32_t>(0))) == "leaf");
    CHECK(*name.at<std::uint32_t>(0) == good(SceneFrame::token_of("leaf")));
    CHECK(*name.at<std::uint32_t>(1) == 0);
    CHECK(SceneFrame::text_of(4'000'000'000).error().kind == SceneError::WrongCall);
    CHECK(SceneFrame::token_of("\xff").error().kind == SceneError::WrongCall);
}

TEST_CASE("a column is not copied, and stays as it is while the scene goes on", "[scene]")
{
    Scene scene = opened(cloud);
    const SceneFrame frame = good(scene.advance_to(4));
    const std::string before = bits_of(frame);
    const SceneColumn P = *frame.column("P");
    REQUIRE(P.count > 1000);
    CHECK(P.stride == 12);
    CHECK(P.components == 3);
    CHECK(P.data == frame.column("P")->data);
    const SceneFrame copy = frame;
    CHECK(copy.column("P")->data == P.data);
    const SceneFrame later = good(scene.advance_to(6));
    CHECK(later.column("P")->data != P.data);
    CHECK(bits_of(frame) == before);
    {
        const Scene gone = std::move(scene);
    }
    CHECK(bits_of(frame) == before);
}

TEST_CASE("a value that all points share is held once, and written out on request", "[scene]")
{
    Scene scene = opened(cloud);
    const SceneFrame frame = good(scene.advance_to(3));
    const SceneColumn shade = *frame.column("shade"), all = *frame.expanded("shade");
    REQUIRE(shade.stride == 0);
    REQUIRE(all.stride == sizeof(float));
    REQUIRE(all.count == frame.size());
    for (std::size_t i = 0; i < all.count; ++i) REQUIRE(*all.at<float>(i) == 0.25f);
    CHECK(frame.expanded("shade")->data == all.data);
    CHECK(frame.expanded("P")->data == frame.column("P")->data);
}

TEST_CASE("parameters are listed with type, default and documentation, and set by name", "[scene]")
{
    Scene scene = opened(cloud);
    REQUIRE(scene.parameters().size() == 3);
    CHECK(scene.parameters()[0].name == "rate");
    CHECK(scene.parameters()[0].doc == "particles born per second");
    CHECK(std::get<double>(scene.parameters()[0].fallback) == 20000);
    CHECK(std::get<std::string>(scene.parameters()[1].value) == "cloud");
    CHECK(std::get<std::array<double, 3>>(scene.parameters()[2].value) == std::array<double, 3>{1, 0, 0});

    const std::size_t many = good(scene.advance_to(3)).size();
    good(scene.set({{"rate", 2000.0}, {"solve.substeps", 3.0}, {"wind", std::array<double, 3>{0, 0, 1}}}));
    CHECK(scene.next_frame() == 1);
    CHECK(std::get<double>(scene.parameters()[0].value) == 2000);
    const SceneFrame few = good(scene.advance_to(3));
    CHECK(few.size() < many / 5);
    CHECK(few.statistics().substeps == 3);

    SceneOptions options;
    options.set = {{"rate", 2000.0}, {"solve.substeps", 3.0}, {"wind", std::array<double, 3>{0, 0, 1}}};
    Scene same = opened(cloud, options);
    CHECK(run(same, 3) == bits_of(few));
}

TEST_CASE("a wrong parameter is an error that changes nothing", "[scene]")
{
    Scene scene = opened(cloud);
    const std::string before = run(scene, 3);
    const auto refused = [&](const std::string& name, SceneValue value) {
        return scene.set(name, std::move(value)).error();
    };
    CHECK_THAT(refused("rat", 1.0).message, Contains("did you mean \"rate\""));
    CHECK_THAT(refused("rate", "many").message, Contains("a number"));
    CHECK_THAT(refused("solve.substep", 1.0).message, Contains("substep"));
    CHECK_THAT(refused("sol.substeps", 1.0).message, Contains("no node \"sol\""));
    CHECK(refused("rate", "many").kind == SceneError::WrongCall);
    CHECK(scene.next_frame() == 4);
    CHECK(std::get<double>(scene.parameters()[0].value) == 20000);
    good(scene.restart());
    CHECK(run(scene, 3) == before);
}

TEST_CASE("errors have their file, line and node", "[scene]")
{
    const auto error_of = [](const std::string& text) {
        Result<Scene> scene = Scene::open_text("wrong.lua", text);
        if (!scene) return scene.error();
        return scene->advance_to(3).error();
    };
    const SceneError syntax = error_of("local x =\n");
    CHECK(syntax.kind == SceneError::WrongScene);
    CHECK(syntax.file == "wrong.lua");
    CHECK(syntax.line > 0);

    const SceneError argument =
        error_of("local rapid = require 'rapid'\n\nreturn rapid.create {} :solve { substeps = -1 }");
    CHECK(argument.kind == SceneError::WrongScene);
    CHECK(argument.line == 3);
    CHECK_THAT(argument.text(), Contains("wrong.lua:3") && Contains("substeps"));

    const SceneError frame = error_of(
        "local rapid = require 'rapid'\nreturn rapid.create { points = rapid.points.grid {} }\n"
        ":points('fails', function(p)\n  if p.index == 7 then error('here') end\nend) :solve {}");
    CHECK(frame.kind == SceneError::FailedFrame);
    CHECK(frame.node == "fails");
    CHECK(frame.line == 4);
    CHECK_THAT(frame.message, Contains("here") && Contains("frame 2"));

    CHECK(Scene::open("not/there.lua").error().kind == SceneError::WrongScene);
    CHECK(Scene::open("").error().kind == SceneError::WrongCall);
    CHECK(Scene::open_text("", cloud).error().kind == SceneError::WrongCall);
    CHECK_THROWS_AS(Scene::open("").value(), std::runtime_error);
}

TEST_CASE("a scene whose frame failed is usable again", "[scene]")
{
    Scene scene = opened(
        "local rapid = require 'rapid'\nlocal bad = rapid.param('bad', 3, '')\n"
        "return rapid.create { points = rapid.points.grid {} }"
        ":points('fails', function(p, frame) if frame.number == bad then error 'x' end end) :solve {}");
    good(scene.advance_to(2));
    CHECK(scene.advance().error().kind == SceneError::FailedFrame);
    const SceneError again = scene.advance().error();
    CHECK(again.kind == SceneError::WrongCall);
    CHECK_THAT(again.message, Contains("restart()"));
    good(scene.restart());
    good(scene.advance_to(2));
    good(scene.set("bad", 5.0));
    CHECK(good(scene.advance_to(4)).number() == 4);
}

TEST_CASE("frames are computed forward", "[scene]")
{
    Scene scene = opened(cloud);
    good(scene.advance_to(3));
    CHECK_THAT(scene.advance_to(3).error().message, Contains("has been computed"));
    CHECK_THAT(scene.advance_to(-1).error().message, Contains("before the scene's first"));
    CHECK(good(scene.advance()).number() == 4);
    const SceneFrame frame = good(scene.advance());
    CHECK_THAT(frame.column("PP").error().message, Contains("no column \"PP\""));
    CHECK_THAT(frame.group("hat").error().message, Contains("did you mean \"hot\""));
    CHECK_THAT(frame.output("mian").error().message, Contains("did you mean \"main\""));
    CHECK_THAT(frame.write("points.nothing").error().message, Contains(".vdb"));
}

TEST_CASE("frames after a snapshot are bit-identical, in this scene and in another", "[scene]")
{
    Scene scene = opened(cloud);
    CHECK(scene.save().error().kind == SceneError::WrongCall);
    good(scene.advance_to(3));
    const SceneSnapshot snapshot = good(scene.save());
    CHECK(snapshot.frame() == 3);
    CHECK(snapshot.size() > 1000);
    const std::string sixth = run(scene, 6);
    good(scene.restore(snapshot));
    CHECK(scene.next_frame() == 4);
    CHECK(run(scene, 6) == sixth);

    Scene other = opened(cloud);
    good(other.restore(snapshot));
    CHECK(run(other, 6) == sixth);

    Scene stranger =
        opened("local rapid = require 'rapid' return rapid.create { points = rapid.points.grid {} } :solve {}");
    CHECK_THAT(stranger.restore(snapshot).error().message, Contains("another graph"));
    good(stranger.advance_to(2));
}

namespace {

// A kernel that never ends from frame 2 on, in compiled code, or a function of the frame, interpreted or compiled.
std::string endless(const std::string& how)
{
    const std::string head =
        "local rapid = require 'rapid'\nlocal create = rapid.create { points = rapid.points.grid {} }\n";
    if (how == "kernel")
        return head +
               "return create:points('spin', function(p, frame)\n"
               "local i = 0\nwhile frame.number > 1 do i = i + 1 end end) :solve {}";
    if (how == "caught")
        return head +
               "return create:gravity { g = function(frame)\n"
               "while frame.number > 1 do pcall(function() local t = {} for i = 1, 9 do t[i] = {} end end) end\n"
               "return vec3(0, 0, 0) end } :solve {}";
    if (how == "body") return head + "while true do end return create:solve {}";
    return head +
           "return create:gravity { g = function(frame)\n"
           "local s = 0\nwhile frame.number > 1 do s = s + math.sin(s) end\nreturn vec3(0, s, 0) end } :solve {}";
}

}  // namespace

TEST_CASE("a script that runs for ever is an error, in compiled code too", "[scene]")
{
    const std::string how = GENERATE("kernel", "caught", "function");
    CAPTURE(how);
    SceneOptions options;
    options.script_seconds = 0.2;
    Scene scene = opened(endless(how), options);
    good(scene.advance());
    const SceneError error = scene.advance().error();
    CHECK(error.kind == SceneError::TooLong);
    CHECK_THAT(error.message, Contains("more than 0.2 s"));
    good(scene.restart());
    CHECK(good(scene.advance()).number() == 1);
    CHECK(scene.advance().error().kind == SceneError::TooLong);
}

TEST_CASE("a scene's body that runs for ever is an error of opening", "[scene]")
{
    SceneOptions options;
    options.script_seconds = 0.2;
    CHECK(Scene::open_text("body.lua", endless("body"), options).error().kind == SceneError::TooLong);
}

TEST_CASE("another thread cancels an advance", "[scene]")
{
    Scene scene = opened(endless("kernel"));
    good(scene.advance());
    std::thread other([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        scene.cancel();
    });
    CHECK(scene.advance().error().kind == SceneError::Cancelled);
    other.join();
    good(scene.restart());
    good(scene.advance());

    scene.cancel();  // nothing is running, so this applies to the next frame
    CHECK(scene.advance().error().kind == SceneError::Cancelled);
    good(scene.restart());
    good(scene.advance());
}

TEST_CASE("a requested stop ends opening and all later calls of a scene", "[scene]")
{
    const test::TemporaryFolder folder;
    const auto after = [](std::stop_source& stop, int milliseconds) {
        return std::jthread([&stop, milliseconds] {
            std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
            stop.request_stop();
        });
    };
    const auto hooks_of = [](const std::stop_source& stop) {
        SceneHooks hooks;
        hooks.stop = stop.get_token();
        return hooks;
    };
    {
        std::stop_source stop;
        const std::jthread other = after(stop, 50);
        const auto scene = SceneInside::open(folder.write("body.lua", endless("body")), {}, hooks_of(stop));
        REQUIRE_FALSE(scene);
        CHECK(scene.error().kind == SceneError::Cancelled);
    }
    const auto file = folder.write("kernel.lua", endless("kernel"));
    {
        std::stop_source stop;
        Scene scene = good(SceneInside::open(file, {}, hooks_of(stop)));
        const SceneFrame first = good(scene.advance());
        const std::jthread other = after(stop, 50);
        CHECK(scene.advance().error().kind == SceneError::Cancelled);
        CHECK(scene.restart().error().kind == SceneError::Cancelled);
        CHECK(SceneInside::points_after_nodes(scene, 1).error().kind == SceneError::Cancelled);
        CHECK(scene.shapes(1).error().kind == SceneError::Cancelled);
        CHECK(SceneInside::arguments(scene, 1).error().kind == SceneError::Cancelled);
        CHECK(first.size() > 0);
    }
    std::stop_source stop;
    stop.request_stop();
    CHECK(SceneInside::open(file, {}, hooks_of(stop)).error().kind == SceneError::Cancelled);
    CHECK(good(SceneInside::open(file, {}, hooks_of(std::stop_source()))).next_frame() == 1);
}

TEST_CASE("parameters are listed even if the plan of a scene fails", "[scene]")
{
    const test::TemporaryFolder folder;
    std::vector<std::string> reported;
    SceneHooks hooks;
    hooks.parameters = [&](const std::vector<SceneParameter>& parameters) {
        for (const SceneParameter& parameter : parameters) reported.push_back(parameter.name);
        throw std::runtime_error("dropped");
    };
    const auto file = folder.write("scene.lua",
                                   "local rapid = require 'rapid'\nlocal s = rapid.param('steps', 0, 'sub-steps')\n"
                                   "return rapid.create {} :solve { substeps = s }");
    CHECK_FALSE(SceneInside::open(file, {}, hooks));
    CHECK(reported == std::vector<std::string>{"steps"});
    SceneOptions right;
    right.set = {{"steps", 2.0}};
    CHECK(good(SceneInside::open(file, right, hooks)).next_frame() == 1);
    CHECK(reported.size() == 2);
}

// A frame that takes minutes without a script; the test ends because it is cancelled.
TEST_CASE("another thread cancels a frame that is long in itself", "[scene]")
{
    const std::string chain =
        GENERATE(":turbulence { amplitude = 1 } :solve { substeps = 1000000 }",
                 ":gravity {} :collide { shape = rapid.shape.sphere { radius = 2 } } :solve { substeps = 1000000 }",
                 ":gravity {} :collide { shape = rapid.shape.plane {} } :contact { radius = 0.05 }"
                 ":solve { substeps = 100, iterations = 10000 }",
                 ":interact { radius = 0.3, separation = 1 } :solve { substeps = 20000 }");
    CAPTURE(chain);
    Scene scene = opened(
        "local rapid = require 'rapid'\nlocal points = rapid.points.grid { size = {3, 3, 3}, spacing = 0.1 }\n"
        "return rapid.create { points = points }" +
        chain);
    good(scene.advance());
    std::thread other([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        scene.cancel();
    });
    CHECK(scene.advance().error().kind == SceneError::Cancelled);
    other.join();
    good(scene.restart());
    good(scene.advance());
}

TEST_CASE("the progress callback is called for each frame, and can end the run", "[scene]")
{
    std::vector<std::int64_t> reported;
    SceneOptions options;
    options.progress = [&](std::int64_t frame, std::int64_t last) {
        CHECK(last == 9);
        reported.push_back(frame);
        return frame < 4;
    };
    Scene scene = opened(cloud, options);
    CHECK(scene.advance_to(9).error().kind == SceneError::Cancelled);
    CHECK(reported == std::vector<std::int64_t>{1, 2, 3, 4});
    Scene whole = opened(cloud);
    good(whole.advance_to(4));
    CHECK(bits_of(good(scene.advance())) == run(whole, 5));
}

TEST_CASE("a call from a callback is refused, and an exception of a callback is an error", "[scene]")
{
    Scene* running = nullptr;
    SceneOptions options;
    options.progress = [&](std::int64_t frame, std::int64_t) {
        CHECK(running->advance().error().kind == SceneError::Busy);
        CHECK(running->set("rate", 1.0).error().kind == SceneError::Busy);
        CHECK(running->restart().error().kind == SceneError::Busy);
        if (frame == 3) throw std::runtime_error("no more");
        if (frame == 4) throw 4;
        return true;
    };
    Scene scene = opened(cloud, options);
    running = &scene;
    CHECK_THAT(scene.advance_to(8).error().message, Contains("progress") && Contains("no more"));
    CHECK_THAT(scene.advance_to(8).error().message, Contains("not a std::exception"));
    running = &scene;
    CHECK(good(scene.advance()).number() == 5);
}

TEST_CASE("what scripts print and what Rapid warns of goes to the scene that it is of", "[scene]")
{
    std::vector<std::string> printed, warned;
    SceneOptions options;
    options.log = [&](LogLevel level, const std::string& text) {
        (level == LogLevel::Print ? printed : warned).push_back(text);
    };
    Scene scene = opened(
        "local rapid = require 'rapid' print('one', 2)\n"
        "local points = rapid.create { points = rapid.points.grid {} }\n"
        "points:write { path = 'nobody.csv' }\nreturn points:solve {}",
        options);
    CHECK(printed == std::vector<std::string>{"one\t2"});
    REQUIRE(warned.size() == 1);
    CHECK_THAT(warned[0], Contains("write"));
    CHECK(scene.warnings() == warned);

    options.log = [](LogLevel, const std::string&) { throw std::runtime_error("full"); };
    const SceneError error = Scene::open_text("a.lua", "print 'x'", options).error();
    CHECK_THAT(error.message, Contains("log threw: full"));
}

TEST_CASE("nothing of a scene need be on disk", "[scene]")
{
    const TemporaryFolder folder;
    const std::filesystem::path points = folder.write("abc.csv", "id,Px,Py,Pz\n0,1,2,3\n");
    SceneOptions options;
    options.find_module = [](const std::string& name) -> std::optional<std::string> {
        if (name == "sizes") return "return { speed = 2 }";
        if (name == "push")
            return "return require('rapid').node { name = 'push', doc = 'Pushes.', points = function(p) p.v = vec3(0, "
                   "0, 1) end }";
        return std::nullopt;
    };
    options.find_file = [&](const std::string& path) { return path == "asset:abc" ? points.string() : std::string(); };
    Scene scene = opened(
        "local rapid = require 'rapid' local sizes = require 'sizes'\n"
        "return rapid.create { points = rapid.points.read 'asset:abc' } :push {} :solve {}",
        options);
    const SceneFrame frame = good(scene.advance_to(25));
    REQUIRE(frame.size() == 1);
    CHECK(frame.column("P")->at<float>(0)[2] == Approx(4));
    CHECK_THAT(Scene::open_text("a.lua", "require 'nowhere'", options).error().message,
               Contains("no module \"nowhere\""));
}

TEST_CASE("limits of memory are errors of the scene that has them", "[scene]")
{
    SceneOptions small;
    small.script_memory = std::size_t{8} << 20;
    const std::string greedy = "local t = {} for i = 1, 1e7 do t[i] = {i} end";
    const SceneError script = Scene::open_text("greedy.lua", greedy, small).error();
    CHECK_THAT(script.message, Contains("needs more than 8 MiB"));
    CHECK(script.kind == SceneError::OutOfMemory);

    const std::string grid =
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.grid { size = {10, 10, 10}, spacing = 0.05 } } :solve {}";
    SceneOptions narrow;
    narrow.memory = std::uint64_t{64} << 20;
    const SceneError process = Scene::open_text("grid.lua", grid, narrow).error();
    CHECK_THAT(process.message, Contains("would need about"));
    CHECK(process.kind == SceneError::OutOfMemory);
    good(Scene::open_text("grid.lua", grid));
}

TEST_CASE("the kind of an error does not follow from its words", "[scene]")
{
    for (const char* words : {"the run was cancelled", "out of memory", "not enough memory in the tank",
                              "set a limit, or set --memory", "--script-memory sets the limit"}) {
        INFO(words);
        const std::string script = std::string("error '") + words + "'";
        CHECK(Scene::open_text("cloud.lua", script).error().kind == SceneError::WrongScene);
        Scene scene = opened(
            "local rapid = require 'rapid'\n"
            "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }\n"
            "  :points('fails', function(p) " +
            script + " end) :solve {}");
        CHECK(scene.advance_to(2).error().kind == SceneError::FailedFrame);
    }
}

TEST_CASE("an error that a script catches and raises again keeps its kind", "[scene]")
{
    SceneOptions options;
    options.memory = std::uint64_t{64} << 20;
    const auto error = [&](const std::string& inner) {
        return Scene::open_text("cloud.lua",
                                "local rapid = require 'rapid'\n"
                                "local _, why = pcall(function() " +
                                    inner + " end)\nerror('again: ' .. why)",
                                options)
            .error();
    };
    const SceneError memory = error("rapid.points.grid { size = {10, 10, 10}, spacing = 0.05 }");
    CHECK_THAT(memory.message, Contains("again: ") && Contains("would need about"));
    CHECK(memory.kind == SceneError::OutOfMemory);
    CHECK(error("rapid.points.grid { size = {10, 10, 10}, spacing = -1 }").kind == SceneError::WrongScene);
}

TEST_CASE("a scene whose frames take more memory than it has is an error, and goes on", "[scene]")
{
    // Detail values with long names, a few hundred MiB in each frame, which no estimate covers.
    const std::string growing =
        "local rapid = require 'rapid'\n"
        "local large = rapid.param('large', 1)\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}} } }\n"
        "  :detail('d', function(points, frame)\n"
        "    for i = 1, large do points.detail[('x'):rep(100) .. i .. '_' .. frame.number] = i end\n"
        "  end) :solve {}";
    SceneOptions options;
    options.memory = 1;  // 128 MiB are tolerated
    options.set = {{"large", 1e6}};
    Scene scene = opened(growing, options);
    const SceneError error = scene.advance_to(9).error();
    CHECK_THAT(error.message, Contains("the run uses") && Contains("or set memory"));
    CHECK(error.kind == SceneError::OutOfMemory);
    CHECK(error.node == "d");
    good(scene.set("large", 1.0));
    CHECK(good(scene.advance_to(4)).size() == 1);

    // Grows only slightly in each frame.
    good(scene.set("large", 3e4));
    CHECK(scene.advance_to(60).error().kind == SceneError::OutOfMemory);
}

TEST_CASE("scenes on threads of their own give the bits of one after the other", "[scene][threads]")
{
    const auto bits = [](int seed) {
        SceneOptions options;
        options.seed = seed;
        options.threads = 2;
        Scene scene = opened(cloud, options);
        return run(scene, 8);
    };
    const std::array<std::string, 3> alone = {bits(1), bits(2), bits(3)};
    CHECK(alone[0] != alone[1]);
    std::array<std::string, 3> together;
    std::vector<std::thread> threads;
    for (int i = 0; i < 3; ++i) threads.emplace_back([&, i] { together[i] = bits(i + 1); });
    for (std::thread& thread : threads) thread.join();
    CHECK(together == alone);
}

TEST_CASE("a scene goes from thread to thread", "[scene][threads]")
{
    Scene scene = opened(cloud), whole = opened(cloud);
    for (int frame = 1; frame <= 6; ++frame) std::thread([&] { good(scene.advance()); }).join();
    good(whole.advance_to(6));
    CHECK(run(scene, 7) == run(whole, 7));
}

TEST_CASE("statistics are those of --stats", "[scene]")
{
    Scene scene = opened(cloud);
    const SceneFrame frame = good(scene.advance_to(4));
    const FrameStatisticsSummary summary = frame.statistics();
    CHECK(summary.points == frame.size());
    CHECK(summary.born > 0);
    CHECK(summary.has_errors);
    CHECK(summary.error_max >= summary.error_p95);
    CHECK_THAT(frame.statistics_json(),
               StartsWith("{") && EndsWith("}") && Contains("\"points\":" + std::to_string(frame.size())));
    SceneOptions options;
    options.estimate_errors = false;
    Scene without = opened(cloud, options);
    const SceneFrame same = good(without.advance_to(4));
    CHECK(!same.statistics().has_errors);
    CHECK(bits_of(same) == bits_of(frame));
}

TEST_CASE("a frame is shown as a picture, and written", "[scene]")
{
    const TemporaryFolder folder;
    Scene scene = opened(cloud);
    const SceneFrame frame = good(scene.advance_to(4));
    CHECK_THAT(good(scene.picture(frame, {64, 36})), StartsWith("\x89PNG"));
    CHECK(scene.picture(frame, {0, 36}).error().kind == SceneError::WrongCall);
    Scene other = opened(cloud);
    CHECK_THAT(other.picture(frame).error().message, Contains("another scene"));
    const auto file = folder.path() / "points.csv";
    good(frame.write(file.string()));
    CHECK(std::filesystem::file_size(file) > 10 * frame.size());
}

TEST_CASE("points that were written are read back bit-identical", "[scene]")
{
    const TemporaryFolder folder;
    Scene scene = opened(cloud);
    const SceneFrame frame = good(scene.advance_to(4));
    REQUIRE(frame.size() > 1000);
    good(frame.write(folder / "cloud.bgeo"));
    const SceneFrame read = good(SceneFrame::read(folder / "cloud.bgeo"));
    CHECK(read.outputs() == std::vector<std::string>{"main"});
    CHECK(read.number() == 0);
    CHECK(read.time() == 0);
    CHECK(read.warnings().empty());
    CHECK(read.details().empty());
    CHECK(read.statistics().points == frame.size());
    CHECK(read.columns() == frame.columns());
    const SceneColumn P = *frame.column("P"), P_read = *read.column("P");
    REQUIRE(P_read.count == P.count);
    for (std::size_t i = 0; i < P.count; ++i) REQUIRE(std::memcmp(P.at<float>(i), P_read.at<float>(i), 12) == 0);
    CHECK(good(frame.compare(read, 0)).same);
    good(read.write(folder / "again.csv"));
    CHECK(good(SceneFrame::read(folder / "again.csv")).size() == frame.size());
    CHECK_THAT(scene.picture(read).error().message, Contains("another scene"));
}

TEST_CASE("skipped contents of a file are reported", "[scene]")
{
    const TemporaryFolder folder;
    const SceneFrame read = good(SceneFrame::read(folder.write(
        "corner.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")));
    CHECK(read.size() == 3);
    CHECK(read.warnings() == std::vector<std::string>{"not read: its 1 elements \"face\""});
}

TEST_CASE("a file that can't be read is an error that names it", "[scene]")
{
    const TemporaryFolder folder;
    const auto fault = [](const std::string& file) {
        const Result<SceneFrame> read = SceneFrame::read(file);
        REQUIRE_FALSE(read);
        CHECK(read.error().kind == SceneError::WrongCall);
        return read.error().text();
    };
    CHECK_THAT(fault(folder / "nothing.bgeo"), StartsWith((folder / "nothing.bgeo").string()));
    CHECK_THAT(fault(folder / "nothing.png"), Contains("points can't be read from a .png file"));
    CHECK_THAT(fault(folder / "nothing.xyz"), Contains(".bgeo") && Contains(".csv"));
    CHECK_THAT(fault(""), Contains(".bgeo"));
    CHECK_THAT(fault(folder.write("torn.bgeo", "BgeoV")), Contains("torn.bgeo"));
}

TEST_CASE("a frame is described", "[scene]")
{
    Scene scene = opened(
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 1, 2}, {3, 5, 7}}, heat = {2, 2} } } :solve {}");
    const SceneReport report = good(good(scene.advance()).describe());
    CHECK_THAT(report.json, StartsWith(R"({"points":2,)"));
    CHECK_THAT(report.json, Contains(R"("bounds":{"min":[0.0,1.0,2.0],"max":[3.0,5.0,7.0]})"));
    CHECK_THAT(report.json, Contains(R"({"name":"heat","type":"float","uniform":true,"min":[2.0],"max":[2.0])"));
    CHECK_THAT(report.text, Contains("bounds      0 1 2  to  3 5 7\n") && Contains("2 everywhere"));
}

TEST_CASE("frames are compared by the ids of their points, within a tolerance", "[scene]")
{
    const char* const text =
        "local rapid = require 'rapid'\n"
        "return rapid.create { points = rapid.points.from { P = {{0, 0, 0}, {3, 4, 0}} } }"
        ":points('move', function(p, frame) if frame.number == 2 and p.id == 1 then p.P = p.P + vec3(1, 0, 0) end end)"
        ":solve {}";
    Scene scene = opened(text);
    const SceneFrame a = good(scene.advance()), b = good(scene.advance());
    const FrameComparison found = good(a.compare(b));
    CHECK_FALSE(found.same);
    CHECK_THAT(found.report.json, StartsWith(R"({"same":false,"points":[2,2],"compared":2,)"));
    CHECK_THAT(found.report.json, Contains(R"("max":1.0)") && Contains(R"("worst_id":1)"));
    CHECK_THAT(found.report.text, StartsWith("different: 2 and 2 points"));
    CHECK(good(a.compare(a, 0)).same);
    // 1 m, where the diagonal of the bounds of both is sqrt(32).
    CHECK_FALSE(good(a.compare(b, 0.99 / std::sqrt(32))).same);
    CHECK(good(a.compare(b, 1.01 / std::sqrt(32))).same);
    for (const double wrong : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()})
        CHECK(a.compare(b, wrong).error().kind == SceneError::WrongCall);
}

TEST_CASE("node types and nodes are listed", "[scene]")
{
    Scene scene = opened(cloud);
    REQUIRE(scene.nodes().size() == 7);
    CHECK(scene.nodes()[0].type == "create");
    CHECK(scene.nodes()[0].file == "cloud.lua");
    CHECK(scene.nodes()[0].line == 6);
    const auto types = good(scene.node_types());
    const auto gravity =
        std::find_if(types.begin(), types.end(), [](const auto& type) { return type.name == "gravity"; });
    REQUIRE(gravity != types.end());
    REQUIRE(gravity->parameters.size() == 2);
    CHECK(gravity->parameters[1].name == "g");
    CHECK(gravity->parameters[1].unit == "m/s²");
    CHECK(gravity->parameters[1].fallback == "{0, -9.81, 0}");
}

}  // namespace rapid
