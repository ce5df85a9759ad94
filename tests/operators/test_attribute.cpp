#include <fmt/format.h>

#include "tests/operators/graph_test.h"

namespace rapid {

using namespace test;

TEST_CASE("attribute gives its value to points that have none", "[attribute]")
{
    NodeTest attribute("attribute",
                       {{"heat", 2.0}, {"Cd", list({1.0, 0.5, 0.0})}, {"orient", list({0.0, 0.0, 0.0, 1.0})}});
    const PointSet points = attribute(2, points_at({{0, 0, 0}, {1, 0, 0}}));
    CHECK(values_of<float>(points, "heat") == std::vector<float>{2, 2});
    CHECK(points.column<float>("heat").is_uniform());
    CHECK(points.column<Vec3f>("Cd")[1] == Vec3f(1, 0.5f, 0));
    CHECK(points.column<Quatf>("orient")[0].coeffs() == Quatf::Identity().coeffs());
}

TEST_CASE("attribute never overwrites, and later points get its value", "[attribute]")
{
    PointSet points = points_at({{0, 0, 0}});
    points.add({"heat", 7.0f});
    points = NodeTest("attribute", {{"heat", 2.0}})(2, points);
    points.append(1);
    CHECK(values_of<float>(points, "heat") == std::vector<float>{7, 2});
}

TEST_CASE("an attribute's value may be a function of the frame: points get that of the frame they come in",
          "[attribute]")
{
    NodeTest attribute("attribute", {{"heat", of_frame([](const Frame& f) { return f.number; })}});
    PointSet points;
    for (std::int64_t frame = 1; frame <= 4; ++frame) {
        points = attribute(frame, points);
        points.append(1);
    }
    CHECK(values_of<float>(points, "heat") == std::vector<float>{1, 2, 3, 4});
}

TEST_CASE("a whole number makes a float; a known name has its own type", "[attribute]")
{
    const PointSet points = NodeTest("attribute", {{"count", 3.0}, {"hitnum", 2.0}, {"life", HUGE_VAL}})(2);
    CHECK(points.find<float>("count"));
    CHECK(points.find<std::int32_t>("hitnum"));
    CHECK(points.find<float>("life"));
}

TEST_CASE("attribute sets all points without a value, whichever node makes the attribute", "[attribute]")
{
    const Uses uses = NodeTest("attribute", {{"heat", 2.0}}).uses();
    REQUIRE(uses.makes.size() == 1);
    REQUIRE(uses.defaults.size() == 1);
    CHECK(std::get<float>(uses.defaults[0].fallback) == 2);
}

TEST_CASE("all points have the value from their birth, except those with a value of their own", "[attribute]")
{
    GraphTest graph;
    const Value place = ObjectPtr(source_of(points_at({{0, 0, 0}})));
    const auto create = graph.node("create", {{"points", place}});
    const auto hot =
        graph.node("emit", {{"source", place}, {"count", 1.0}, {"attributes", named({{"heat", 7.0}})}}, {create});
    const auto plain = graph.node("emit", {{"source", place}, {"count", 1.0}}, {hot});
    const auto attribute =
        graph.node("attribute", {{"heat", of_frame([](const Frame& f) { return f.number; })}}, {plain});
    graph.run(graph.node("hold", {}, {attribute}));

    CHECK(values_of<float>(graph.next_frame(), "heat") == std::vector<float>{1});
    CHECK(values_of<float>(graph.next_frame(), "heat") == std::vector<float>{1, 7, 2});
    CHECK(values_of<float>(graph.next_frame(), "heat") == std::vector<float>{1, 7, 2, 7, 3});
}

TEST_CASE("points that are given a life have an age", "[attribute]")
{
    GraphTest graph;
    const Value place = ObjectPtr(source_of(points_at({{0, 0, 0}})));
    const auto create = graph.node("create", {{"points", place}});
    graph.run(graph.node("solve", {}, {graph.node("attribute", {{"life", 2.0}}, {create})}));
    const PointSet points = graph.next_frame();
    CHECK(values_of<float>(points, "life") == std::vector<float>{2});
    CHECK(values_of<float>(points, "age") == std::vector<float>{0});
}

TEST_CASE("attribute refuses illegal names and values", "[attribute]")
{
    const auto refusal = [](const std::string& name, Value value) {
        return error_of([&] { NodeTest("attribute", {{name, value}}); });
    };
    for (const char* own : {"P", "v", "id", "dt", "index", "kill"})
        CHECK(refusal(own, 1.0) ==
              fmt::format("\"{}\" can't be an attribute, because Rapid uses this name; choose another one", own));
    CHECK(refusal("2nd", 1.0) ==
          "attribute name \"2nd\" can't be used; use letters, digits and _, and no digit at the beginning");
    CHECK(refusal("heat", true) ==
          "heat = true has the wrong type; it must be a number, a vec3 or {x, y, z}, a quaternion {x, y, z, w} or a "
          "string");
    CHECK(refusal("mass", "heavy") == "mass = \"heavy\" has the wrong type; it must be a number");
    CHECK(refusal("pscale", list({1.0, 1.0, 1.0})) == "pscale = {1, 1, 1} has the wrong type; it must be a number");
    CHECK(refusal("heat", std::numeric_limits<double>::quiet_NaN()) == "heat = nan is out of range; it must be finite");
    CHECK(refusal("hitnum", 0.5) == "hitnum = 0.5 is not whole; it must be an integer");
}

TEST_CASE("attribute makes no pruned attribute", "[attribute]")
{
    NodeTest attribute("attribute", {{"heat", 2.0}, {"wet", 1.0}});
    attribute.pruned = {"heat"};
    CHECK(attribute(2, points_at({{0, 0, 0}})).column_names() == std::vector<std::string>{"P", "id", "v", "wet"});
}

}  // namespace rapid
