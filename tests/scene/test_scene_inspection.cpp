// The contents of a scene and of one of its frames, computed without moving the scene.
#include <algorithm>
#include <cstring>

#include "bindings/scene/scene_inside.h"
#include "include/rapid/scene.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains;
using test::good;

Scene opened(const std::string& text, SceneOptions options = {})
{
    return test::opened("local rapid = require 'rapid'\n" + text, std::move(options), "inspected.lua");
}

const char* const warm =
    "return rapid.create { points = rapid.points.from { P = {{0, 1, 0}, {5, 1, 0}} } } :attribute { heat = 2 }"
    ":points('warm', function(p) p.heat = p.heat * 3 end)"
    ":gravity { name = 'down', g = function(frame) return vec3(0, -frame.number, 0) end } :solve {}";

// Two chains whose points have the same ids.
const char* const merged =
    "local function chain(name, x) return rapid.create { name = name, points = rapid.points.from {"
    "P = {{x, 1, 0}, {x, 2, 0}} } } :gravity {} :solve { name = name .. '_solve' } end\n";

void check_equal(const SceneFrame& a, const SceneFrame& b)
{
    REQUIRE(a.size() == b.size());
    CHECK(a.columns() == b.columns());
    const SceneColumn of_a = *a.column("P"), of_b = *b.column("P");
    for (std::size_t i = 0; i < of_a.count; ++i) CHECK(std::memcmp(of_a.at<float>(i), of_b.at<float>(i), 12) == 0);
}

const SceneAttribute& found(const std::vector<SceneAttribute>& all, const std::string& name)
{
    const auto one = std::find_if(all.begin(), all.end(), [&](const auto& each) { return each.name == name; });
    if (one == all.end()) FAIL("no attribute " << name);
    return *one;
}

}  // namespace

TEST_CASE("outputs are known before a frame, with the creates whose points they hold", "[inspection]")
{
    Scene scene =
        opened(std::string(merged) + "return { left = chain('a', 0), both = chain('b', 1):merge(chain('c', 2)) }");
    REQUIRE(SceneInside::outputs(scene).size() == 2);
    CHECK(SceneInside::outputs(scene)[0].name == "both");
    CHECK(SceneInside::outputs(scene)[0].creates == std::vector<std::string>{"b", "c"});
    CHECK(SceneInside::outputs(scene)[1].name == "left");
    CHECK(SceneInside::outputs(scene)[1].creates == std::vector<std::string>{"a"});
    CHECK(opened("return rapid.create { fps = 30 } :solve {}").fps() == 30);
}

TEST_CASE("attributes are listed with their size and whether they are kept", "[inspection]")
{
    Scene scene = opened(
        "return rapid.create { name = 'made' } :attribute { heat = 1 } :group { name = 'low', where = function(p) "
        "return "
        "p.P.y < 0 end } :gravity {} :solve {}");
    const std::vector<SceneAttribute> all = good(SceneInside::attributes(scene));
    CHECK(found(all, "P").bytes == 12);
    CHECK(found(all, "P").create == "made");
    CHECK(found(all, "P").is_kept);
    CHECK(found(all, "heat").bytes == 4);
    CHECK_FALSE(found(all, "hittime").is_kept);
    CHECK(std::none_of(all.begin(), all.end(), [](const auto& one) { return one.name == "substeps"; }));
}

TEST_CASE("a scene with per-point diagnostics has the attributes of its solve", "[inspection]")
{
    const test::TemporaryFolder folder;
    const auto file = folder.write("scene.lua", std::string("local rapid = require 'rapid'\n") + warm);
    SceneHooks hooks;
    hooks.per_point_diagnostics = true;
    Scene scene = good(SceneInside::open(file, {}, hooks));
    for (const char* const name : {"error", "substeps", "asleep"}) {
        CHECK(found(good(SceneInside::attributes(scene)), name).is_kept);
        CHECK(good(scene.advance()).column(name)->count == 2);
    }
}

TEST_CASE("arguments are reported as strings, functions with their value in a frame", "[inspection]")
{
    Scene scene = opened(warm);
    CHECK(good(SceneInside::arguments(scene, 3)).at("down").at("g") == "{0, -3, 0}");
    CHECK(good(SceneInside::arguments(scene, 7)).at("down").at("g") == "{0, -7, 0}");
    CHECK(scene.next_frame() == 1);
    Scene wrong = opened(
        "return rapid.create {} :gravity { g = function(frame) if frame.number > 1 then error 'no g' end "
        "return vec3(0, 0, 0) end } :solve {}");
    const auto arguments = SceneInside::arguments(wrong, 2);
    REQUIRE_FALSE(arguments);
    CHECK_THAT(arguments.error().message, Contains("no g"));
}

TEST_CASE("points after all nodes equal those after each node, and the scene stays at its frame", "[inspection]")
{
    Scene scene = opened(warm);
    good(scene.advance_to(3));
    const SceneSnapshot snapshot = good(scene.save());
    good(scene.advance_to(5));
    const auto from_start = good(SceneInside::points_after_nodes(scene, 4));
    CHECK(scene.next_frame() == 6);
    const SceneFrame sixth = good(scene.advance());

    Scene again = opened(warm);
    const auto from_snapshot = good(SceneInside::points_after_nodes(again, 4, snapshot));
    check_equal(sixth, good(again.advance_to(6)));
    REQUIRE(from_start.size() == from_snapshot.size());
    for (const auto& [node, points] : from_start) {
        CAPTURE(node);
        CHECK(points.outputs() == std::vector<std::string>{node});
        CHECK(points.number() == 4);
        CHECK(points.time() == Approx(3 / 24.0));
        check_equal(points, from_snapshot.at(node));
        check_equal(points, good(again.points_after(node, 4)));
    }
    CHECK(from_start.contains("warm"));
    CHECK(from_start.contains("solve1"));
}

TEST_CASE("points after all nodes change with the parameters", "[inspection]")
{
    Scene scene = opened(
        "local x = rapid.param('x', 1, 'm')\n"
        "return rapid.create { points = rapid.points.from { P = {{x, 0, 0}} } } :solve {}");
    CHECK(good(SceneInside::points_after_nodes(scene, 2)).at("solve1").column("P")->at<float>(0)[0] == 1);
    good(scene.set("x", 4.0));
    CHECK(good(SceneInside::points_after_nodes(scene, 2)).at("solve1").column("P")->at<float>(0)[0] == 4);
}

TEST_CASE("a wrong frame or snapshot for the points after nodes is refused", "[inspection]")
{
    Scene scene = opened(warm);
    const SceneError early = SceneInside::points_after_nodes(scene, 0).error();
    CHECK(early.kind == SceneError::WrongCall);
    CHECK_THAT(early.message, Contains("before the scene's first, 1"));

    good(scene.advance_to(3));
    const SceneSnapshot third = good(scene.save());
    CHECK_THAT(SceneInside::points_after_nodes(scene, 3, third).error().message,
               Contains("the snapshot is after frame 3; frame 3 needs an earlier one"));
    Scene other = opened("return rapid.create {} :solve {}");
    good(other.advance());
    CHECK_THAT(SceneInside::points_after_nodes(scene, 3, good(other.save())).error().message,
               Contains("to another graph"));
    CHECK(good(scene.advance()).number() == 4);
}

TEST_CASE("a failed frame has no points after nodes, but the frames before it do", "[inspection]")
{
    Scene scene = opened(
        "return rapid.create { points = rapid.points.grid {} }\n"
        ":points('hot', function(p, frame) if frame.number == 3 then error 'hot' end end) :solve {}");
    CHECK(scene.advance_to(3).error().kind == SceneError::FailedFrame);
    const SceneError error = SceneInside::points_after_nodes(scene, 3).error();
    CHECK(error.kind == SceneError::FailedFrame);
    CHECK(error.node == "hot");
    CHECK(good(SceneInside::points_after_nodes(scene, 2)).contains("hot"));
}

TEST_CASE("a point of a merge is traced back to its create", "[inspection]")
{
    Scene scene = opened(std::string(merged) + "return chain('a', 0):merge(chain('b', 7))");
    const SceneFrame frame = good(scene.advance_to(4));
    REQUIRE(frame.size() == 4);
    for (std::size_t i = 0; i < 4; ++i) {
        const float* P = frame.column("P")->at<float>(i);
        const PointOrigin origin = good(SceneInside::origin(scene, frame, *frame.column("id")->at<std::int64_t>(i)));
        CHECK(origin.create == (P[0] < 1 ? "a" : "b"));
        CHECK(origin.id == (P[1] > 1.5f ? 1 : 0));
    }
    CHECK(scene.next_frame() == 5);
    CHECK_THAT(SceneInside::origin(scene, frame, 99).error().message, Contains("not in this frame"));

    Scene single = opened(warm);
    const PointOrigin same = good(SceneInside::origin(single, good(single.advance_to(2)), 1));
    CHECK(same.create == "create1");
    CHECK(same.id == 1);
}

TEST_CASE("a point of a merge that its index does not identify is an error with the reason", "[inspection]")
{
    Scene twice = opened(std::string(merged) + "return chain('a', 0):merge(chain('b', 0))");
    CHECK_THAT(SceneInside::origin(twice, good(twice.advance_to(2)), 0).error().message,
               Contains("several points have this position and velocity; choose another frame"));
    Scene moved =
        opened(std::string(merged) +
               "return chain('a', 0):merge(chain('b', 7)) :points('up', function(p) p.P = p.P + vec3(0, 0.3, 0) end)");
    CHECK_THAT(SceneInside::origin(moved, good(moved.advance_to(2)), 0).error().message, Contains("have moved it"));
    Scene other = opened("return { sparks = rapid.create { points = rapid.points.grid {} } :solve {} }");
    CHECK_THAT(SceneInside::origin(moved, good(other.advance_to(2)), 0).error().message,
               Contains("an output \"sparks\" that the scene does not have"));
}

TEST_CASE("a graph without a layout has the same nodes as one with a layout", "[inspection]")
{
    Scene scene = opened(warm);
    const std::string bare = good(SceneInside::graph_json(scene, nullptr));
    CHECK_THAT(bare, Contains(R"("name":"warm")"));
    const std::string laid_out = good(scene.graph(GraphForm::Json));
    GraphLayout layout;
    CHECK(good(SceneInside::graph_json(scene, &layout)) == laid_out);
    CHECK(bare.size() < laid_out.size());
    REQUIRE_FALSE(layout.graph.empty());

    // The same graph with another value keeps its layout.
    const GraphLayout kept = layout;
    layout.positions = "{}";
    CHECK_FALSE(good(SceneInside::graph_json(scene, &layout)) == laid_out);
    layout.graph = "of another one";
    CHECK(good(SceneInside::graph_json(scene, &layout)) == laid_out);
    CHECK(layout.graph == kept.graph);
}

}  // namespace rapid
