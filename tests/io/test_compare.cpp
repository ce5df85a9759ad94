#include "runtime/io/compare.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

nlohmann::ordered_json json_of(const auto& reported) { return nlohmann::ordered_json::parse(to_json(reported)); }

const AttributeDifference& of(const Comparison& comparison, const std::string& name)
{
    for (const AttributeDifference& d : comparison.attributes)
        if (d.name == name) return d;
    for (const AttributeDifference& d : comparison.groups)
        if (d.name == name) return d;
    throw std::out_of_range(name);
}

// Twenty points in the unit cube's diagonal, so that the bounds' diagonal is √3 m.
PointSet diagonal_points()
{
    PointSet points;
    points.append(20);
    for (std::size_t i = 0; i < 20; ++i) {
        points.P().write()[i] = Vec3f::Constant(static_cast<float>(i) / 19);
        points.id().write()[i] = static_cast<std::int64_t>(100 + i);
    }
    return points;
}

}  // namespace

TEST_CASE("a set is the same as itself, and as itself in another order", "[io][compare]")
{
    const PointSet a = random_points({.size = 500});
    CHECK(compare(a, a).same);

    PointSet b;
    b.append(500);
    for (const auto& [name, column] : a.columns())
        b.set(name, std::visit(
                        [](const auto& c) -> AnyColumn {
                            auto copy = c;
                            auto values = copy.write();
                            std::reverse(values.begin(), values.end());
                            return copy;
                        },
                        column));
    for (const auto& [name, members] : a.groups()) {
        b.group(name) = members;
        std::span<std::uint8_t> values = b.group(name).write();
        std::reverse(values.begin(), values.end());
    }
    const Comparison comparison = compare(a, b);
    CHECK(comparison.same);
    CHECK(comparison.compared == 500);
}

TEST_CASE("sets in which two points have one id can't be compared", "[io][compare]")
{
    const PointSet a = diagonal_points();
    PointSet b = a;
    b.id().write()[3] = 119;
    CHECK(error_of([&] { compare(a, b); }) ==
          "two points of B have the id 119; points are compared by id, so ids must be unique");
    CHECK(error_of([&] { compare(b, a); }) ==
          "two points of A have the id 119; points are compared by id, so ids must be unique");
}

TEST_CASE("max, rms and p95 are those of the lengths of the differences", "[io][compare]")
{
    const PointSet a = diagonal_points();
    PointSet b = a;
    // 19 points differ by 0 and one by 5 (3-4-5); then two of twenty, of which one is beyond the 95th percentile.
    b.v().write()[4] = Vec3f(3, 0, 4);

    const AttributeDifference one = of(compare(a, b), "v");
    CHECK(one.max == 5);
    CHECK(one.worst_id == 104);
    CHECK(one.rms == Approx(std::sqrt(25.0 / 20)));
    CHECK(one.p95 == 0);
    CHECK(one.different == 1);
    CHECK_FALSE(one.same);

    b.v().write()[5] = Vec3f(0, 2, 0);
    CHECK(of(compare(a, b), "v").p95 == 2);
}

TEST_CASE("P is the same within 1e-6 of the bounds' diagonal, the rest within 1e-6 of the value", "[io][compare]")
{
    const PointSet a = diagonal_points();
    PointSet b = a;
    const float allowed = 1e-6f * std::sqrt(3.0f);
    b.P().write()[0].x() += 0.99f * allowed;
    CHECK(compare(a, b).same);
    b.P().write()[0].x() = 1.01f * allowed;
    CHECK_FALSE(compare(a, b).same);
    CHECK(compare(a, b, 1e-5).same);

    PointSet c = diagonal_points(), d = diagonal_points();
    c.add({"heat", 1000.0f});
    d.add({"heat", 1000.0009f});
    CHECK(compare(c, d).same);
    d.column<float>("heat").fill(1000.002f);
    CHECK_FALSE(compare(c, d).same);
    CHECK_FALSE(compare(c, d, 0).same);
}

TEST_CASE("integers and groups are the same only when they are equal, int64 to the last bit", "[io][compare]")
{
    PointSet a = diagonal_points(), b = a;
    a.add({"serial", std::int64_t{1} << 60});
    b.add({"serial", (std::int64_t{1} << 60) + 1});
    CHECK(of(compare(a, b, 1e-3), "serial").different == 20);

    PointSet c = diagonal_points(), d = c;
    c.group("hot").write()[3] = 1;
    CHECK(of(compare(c, d), "hot").different == 1);
    CHECK_FALSE(compare(c, d).same);
    c.group("hot").write()[3] = 0;
    CHECK(compare(c, d).same);  // an empty group is no difference
}

TEST_CASE("NaN equals NaN and differs infinitely from a number", "[io][compare]")
{
    PointSet a = diagonal_points();
    a.add({"heat", std::numeric_limits<float>::quiet_NaN()});
    PointSet b = a;
    CHECK(compare(a, b).same);
    b.column<float>("heat").write()[2] = 1;
    const AttributeDifference heat = of(compare(a, b), "heat");
    CHECK(std::isinf(heat.max));
    CHECK(heat.worst_id == 102);
    CHECK_FALSE(heat.same);
    CHECK(json_of(compare(a, b))["attributes"][2]["max"].is_null());
}

TEST_CASE("missing points and attributes are differences, and are named", "[io][compare]")
{
    const PointSet a = diagonal_points();
    PointSet b = a;
    std::vector<std::uint8_t> keep(20, 1);
    keep[7] = keep[9] = 0;
    b.keep(keep);
    b.add({"heat", 1.0f});

    const Comparison comparison = compare(a, b);

    CHECK_FALSE(comparison.same);
    CHECK(comparison.compared == 18);
    CHECK(comparison.only_a == std::vector<std::int64_t>{107, 109});
    CHECK(comparison.only_b.empty());
    CHECK(of(comparison, "P").same);
    CHECK_FALSE(of(comparison, "heat").same);
    CHECK(to_text(comparison) ==
          "different: 20 and 18 points, 18 compared, tolerance 1e-06 (1.73e-06 m for P)\n"
          "2 points are only in A: ids 107, 109\n"
          "  P     vec3   equal\n"
          "  v     vec3   equal\n"
          "  heat  only in B (float)\n");
    CHECK(json_of(comparison)["only_a"] == nlohmann::ordered_json({107, 109}));
    CHECK(compare(PointSet(),
                  [] {
                      PointSet none;
                      none.add({"heat", 1.0f});
                      return none;
                  }())
              .same);
}

TEST_CASE("an integer and a float of equal value are the same, a vector and a scalar are not", "[io][compare]")
{
    PointSet a = diagonal_points(), b = a;
    a.add({"hits", std::int32_t{3}});
    b.add({"hits", 3.0f});
    CHECK(compare(a, b).same);
    a.add({"Cd", Vec3f(1, 1, 1)});
    b.add({"Cd", 1.0f});
    CHECK_FALSE(compare(a, b).same);
    CHECK_THAT(to_text(compare(a, b)), Catch::Contains("vec3 / float  can't be compared"));
}

TEST_CASE("strings are compared by their characters, not by the order of their tokens", "[io][compare]")
{
    PointSet a = diagonal_points(), b = a;
    a.add({"name", token_of("leaf")});
    b.add({"name", token_of("leaf")});
    CHECK(compare(a, b).same);
    b.column<Token>("name").write()[4] = token_of("bark");
    const Comparison comparison = compare(a, b, 1);
    CHECK_FALSE(comparison.same);
    CHECK_THAT(to_text(comparison), Catch::Contains("name  string 1 differ (id 104 first)"));
    b.set("name", Column<float>(b.size(), 1.0f));
    CHECK_THAT(to_text(compare(a, b)), Catch::Contains("string / float  can't be compared"));
}

TEST_CASE("a description shows the texts of an attribute, in order, and how many there are", "[io][describe]")
{
    PointSet points = diagonal_points();
    points.add({"name", token_of("leaf")});
    CHECK_THAT(to_text(describe(points)), Catch::Contains("  name        string  \"leaf\" everywhere\n"));
    points.column<Token>("name").write()[4] = token_of("bark");
    CHECK_THAT(to_text(describe(points)), Catch::Contains("  name        string  \"bark\" \"leaf\"\n"));
    for (std::size_t i = 0; i < points.size(); ++i)
        points.column<Token>("name").write()[i] = token_of(fmt::format("t{:02}", i));
    CHECK_THAT(to_text(describe(points)),
               Catch::Contains("\"t00\" \"t01\"") && Catch::Contains("\"t07\" ... of 20 strings"));
    const auto json = json_of(describe(points))["attributes"][3];
    CHECK(json["texts"] == 20);
    CHECK(json["first_texts"][0] == "t00");
}

TEST_CASE("names in a description are shown without what a terminal would take for commands", "[io][describe]")
{
    PointSet points;
    points.append(1);
    points.add({"a\x1b[2J", 1.0f});
    points.group("b\r");
    const std::string text = to_text(describe(points));
    CHECK_THAT(text, Catch::Contains("a\\x1b[2J") && Catch::Contains("b\\x0d"));
    CHECK(text.find('\x1b') == std::string::npos);
}

TEST_CASE("a description has the ranges, counts and bounds of the points", "[io][describe]")
{
    PointSet points = diagonal_points();
    points.P().write()[3] = Vec3f(-2, 5, 0);
    points.add({"heat", 0.25f});
    points.add({"age", 0.0f});
    points.column<float>("age").write()[1] = std::numeric_limits<float>::infinity();
    points.group("hot").write()[3] = 1;

    const PointSummary summary = describe(points);

    CHECK(summary.points == 20);
    CHECK(summary.bytes == points.bytes());
    CHECK_THAT(summary.bounds.min().eval(), close_to(Vec3f(-2, 0, 0), 0));
    CHECK_THAT(summary.bounds.max().eval(), close_to(Vec3f(1, 5, 1), 0));
    CHECK(summary.groups[0].members == 1);
    const nlohmann::ordered_json json = json_of(summary);
    CHECK(json["attributes"][2] == nlohmann::ordered_json::parse(R"({"name": "id", "type": "int64", "uniform": false,
        "min": [100.0], "max": [119.0], "not_finite": 0})"));
    const std::string text = to_text(summary);
    CHECK_THAT(text, Catch::Contains("points      20\n"));
    CHECK_THAT(text, Catch::Contains("bounds      -2 0 0  to  1 5 1\n"));
    CHECK_THAT(text, Catch::Contains("  heat        float  0.25 everywhere\n"));
    CHECK_THAT(text, Catch::Contains("  age         float  0  to  0  (1 not finite)\n"));
    CHECK_THAT(text, Catch::Contains("groups\n  hot         1\n"));
    CHECK(describe(PointSet()).bounds.isEmpty());
}
