#include "tests/operators/right_of.h"

namespace rapid {

using namespace test;

TEST_CASE("delete removes the points of a group, in order", "[delete]")
{
    PointSet points = three_points();
    points.group("middle").write()[1] = 1;
    NodeTest remove("delete", {{"group", "middle"}});
    CHECK(ids_of(remove(2, points)) == std::vector<std::int64_t>{0, 2});
    CHECK(remove.figures.died == 1);
}

TEST_CASE("delete removes the points for which where is true", "[delete]")
{
    CHECK(ids_of(NodeTest("delete", {{"where", right_of(0.5f)}})(2, three_points())) == std::vector<std::int64_t>{0});
}

TEST_CASE("delete with a group and where removes the points for which both hold", "[delete]")
{
    PointSet points = three_points();
    const auto ends = points.group("ends").write();
    ends[0] = ends[2] = 1;
    CHECK(ids_of(NodeTest("delete", {{"group", "ends"}, {"where", right_of(0.5f)}})(2, points)) ==
          std::vector<std::int64_t>{0, 1});
}

TEST_CASE("a group without points deletes nothing", "[delete][extreme]")
{
    CHECK(NodeTest("delete", {{"group", "nobody"}})(2, three_points()).size() == 3);
    CHECK(NodeTest("delete", {{"group", "nobody"}})(2, {}).empty());
}

TEST_CASE("delete needs a group or where", "[delete]")
{
    CHECK(error_of([] { NodeTest("delete", {}); }) == "no points are selected; give group, where or both");
}

}  // namespace rapid
