#include "tests/operators/right_of.h"

namespace rapid {

using namespace test;

namespace {

std::vector<std::uint8_t> members(const PointSet& points, std::string_view group)
{
    const Column<std::uint8_t>* column = points.find_group(group);
    REQUIRE(column);
    std::vector<std::uint8_t> result;
    for (std::size_t i = 0; i < points.size(); ++i) result.push_back((*column)[i]);
    return result;
}

using Members = std::vector<std::uint8_t>;

}  // namespace

TEST_CASE("group holds the points for which where is true", "[group]")
{
    NodeTest group("group", {{"name", "right"}, {"where", right_of(0.5f)}});
    CHECK(members(group(2, three_points()), "right") == Members{0, 1, 1});
    CHECK(group.uses().makes_groups == std::vector<std::string>{"right"});
    CHECK(group.uses().reads == std::vector<std::string>{"P"});
}

TEST_CASE("membership is determined at each frame: a point that no longer qualifies leaves", "[group]")
{
    PointSet points = three_points();
    points.group("right").fill(1);
    CHECK(members(NodeTest("group", {{"name", "right"}, {"where", right_of(1.5f)}})(2, points), "right") ==
          Members{0, 0, 1});
}

TEST_CASE("without where all points are members", "[group]")
{
    const PointSet points = NodeTest("group", {{"name", "all"}})(2, three_points());
    CHECK(members(points, "all") == Members{1, 1, 1});
    CHECK(points.find_group("all")->is_uniform());
}

TEST_CASE("with group, only points of that group are tested and can be members", "[group]")
{
    PointSet points = points_at({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {100, 0, 0}});
    const auto left = points.group("left").write();
    left[0] = left[1] = 1;
    NodeTest both("group", {{"name", "x"}, {"group", "left"}, {"where", right_of(0.5f)}});
    CHECK(members(both(2, points), "x") == Members{0, 1, 0, 0});
    CHECK(both.uses().reads_groups == std::vector<std::string>{"left"});

    NodeTest copy("group", {{"name", "x"}, {"group", "left"}});
    CHECK(members(copy(2, points), "x") == Members{1, 1, 0, 0});
}

TEST_CASE("a group of no points is a group", "[group][extreme]")
{
    CHECK(members(NodeTest("group", {{"name", "x"}, {"where", right_of(0)}})(2, {}), "x").empty());
    CHECK(members(NodeTest("group", {{"name", "x"}})(2, {}), "x").empty());
}

TEST_CASE("a group needs a name", "[group]")
{
    CHECK(error_of([] { NodeTest("group", {}); }) ==
          "name is missing: name of the group (a name without a value counts as missing)");
    CHECK(error_of([] { NodeTest("group", {{"name", ""}}); }) == "name = \"\" is empty; give the group a name");
}

TEST_CASE("a pruned group is neither made nor tested", "[group]")
{
    NodeTest group("group", {{"name", "hot"}});
    group.pruned = {"group:hot"};
    CHECK(group(2, points_at({{0, 0, 0}})).group_names().empty());
}

}  // namespace rapid
