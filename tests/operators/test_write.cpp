#include "tests/operators/node_test.h"

namespace rapid {

using namespace test;

namespace {

PointSet some_points()
{
    PointSet points = points_at({{0, 0, 0}, {1, 0, 0}});
    points.add({"heat", 1.0f});
    points.add({"Cd", Vec3f(1, 0, 0)});
    points.add({"dt", 0.5f});
    points.group("hot").write()[1] = 1;
    return points;
}

struct Written {
    std::string pattern;
    std::vector<PointSet> sets;
};

Written write(Arguments arguments, bool at_start = false)
{
    NodeTest node("write", std::move(arguments));
    Written written;
    node.write = [&](const std::string& pattern, const PointSet& points) {
        written.pattern = pattern;
        written.sets.push_back(points);
    };
    const PointSet passed = at_start ? node.at_start(some_points()) : node(2, some_points());
    CHECK(passed.column_names() == some_points().column_names());
    CHECK(passed.size() == 2);
    return written;
}

}  // namespace

TEST_CASE("write writes all attributes and groups, and passes the points on unchanged", "[write]")
{
    const Written written = write({{"file", "a.####.vdb"}});
    CHECK(written.pattern == "a.####.vdb");
    REQUIRE(written.sets.size() == 1);
    CHECK(written.sets[0].column_names() == std::vector<std::string>{"Cd", "P", "heat", "id", "v"});
    CHECK(written.sets[0].group_names() == std::vector<std::string>{"hot"});
}

TEST_CASE("write writes P, v, id and the named attributes", "[write]")
{
    CHECK(write({{"file", "a.csv"}, {"attributes", list({"heat"})}}).sets[0].column_names() ==
          std::vector<std::string>{"P", "heat", "id", "v"});
    CHECK(NodeTest("write", {{"file", "a.csv"}, {"attributes", "heat"}}).uses().reads ==
          std::vector<std::string>{"heat"});
}

TEST_CASE("write writes only the points of its group", "[write]")
{
    CHECK(ids_of(write({{"file", "a.csv"}, {"group", "hot"}}).sets[0]) == std::vector<std::int64_t>{1});
}

TEST_CASE("write begins with the first frame", "[write]")
{
    CHECK(write({{"file", "a.csv"}}, /*at_start=*/true).sets.size() == 1);
}

TEST_CASE("where nothing may be written, write does nothing", "[write]")
{
    NodeTest node("write", {{"file", "a.csv"}});
    CHECK(node(2, some_points()).size() == 2);
}

TEST_CASE("write needs a file", "[write]")
{
    CHECK(error_of([] {
              NodeTest("write", {{"file", ""}});
          }) == "file = \"\" is empty; give a pattern such as \"points.####.vdb\"");
}

}  // namespace rapid
