#include "runtime/points/point_set.h"

#include <algorithm>

#include "runtime/points/per_point.h"
#include "tests/test.h"

namespace rapid {
namespace {

using test::points;

std::vector<std::int64_t> ids_of(const PointSet& set)
{
    std::vector<std::int64_t> ids;
    for (std::size_t i = 0; i < set.size(); ++i) ids.push_back(set.id()[i]);
    return ids;
}

}  // namespace

TEST_CASE("a set has P, v and id, and no other attributes", "[point_set]")
{
    const PointSet set;
    CHECK(set.empty());
    CHECK(set.column_names() == std::vector<std::string>{"P", "id", "v"});
    CHECK(set.groups().empty());
}

TEST_CASE("appended points are at the origin, at rest, without an id, and have every attribute's fallback",
          "[point_set]")
{
    PointSet set = points({{1, 2, 3}}).set<float>("heat", {5}).group("hot", {0});
    set.column<float>("heat").set_fallback(0.5f);

    set.append(2);

    REQUIRE(set.size() == 3);
    CHECK(ids_of(set) == std::vector<std::int64_t>{0, -1, -1});
    CHECK(set.P()[0] == Vec3f(1, 2, 3));
    CHECK(set.P()[2] == Vec3f(0, 0, 0));
    CHECK(set.v()[2] == Vec3f(0, 0, 0));
    CHECK(set.column<float>("heat")[2] == 0.5f);
    CHECK(int{(*set.find_group("hot"))[0]} == 1);
    CHECK(int{(*set.find_group("hot"))[2]} == 0);
}

TEST_CASE("as many points as fill several chunks are appended with values of their own, on any thread",
          "[point_set][threads]")
{
    constexpr std::size_t n = 10000;
    PointSet set = points({{1, 2, 3}, {4, 5, 6}}).set<float>("heat", {5, 6}).group("hot", {0});
    set.append(n, {{"v", Vec3f(0, 1, 0)}, {"heat", 0.25f}}, {"hot"});

    REQUIRE(set.size() == n + 2);
    const auto count = [&](const auto& column, const auto& value) {
        std::size_t found = 0;
        for (std::size_t i = 2; i < set.size(); ++i) found += column[i] == value;
        return found;
    };
    CHECK(count(set.P(), Vec3f(0, 0, 0)) == n);
    CHECK(count(set.v(), Vec3f(0, 1, 0)) == n);
    CHECK(count(set.id(), std::int64_t{-1}) == n);
    CHECK(count(set.column<float>("heat"), 0.25f) == n);
    CHECK(count(*set.find_group("hot"), std::uint8_t{1}) == n);
    CHECK(set.P()[1] == Vec3f(4, 5, 6));
    CHECK(int{(*set.find_group("hot"))[1]} == 0);
}

TEST_CASE("removing points keeps the order, ids and values of the others", "[point_set]")
{
    PointSet set = points({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}).group("odd", {1, 3});
    set.add({"mass", 2.0f});

    set.keep(std::vector<std::uint8_t>{0, 1, 0, 1});

    REQUIRE(set.size() == 2);
    CHECK(ids_of(set) == std::vector<std::int64_t>{1, 3});
    CHECK(set.P()[1] == Vec3f(3, 0, 0));
    CHECK(int{(*set.find_group("odd"))[0]} == 1);
    CHECK(set.column<float>("mass").size() == 2);
    CHECK(set.column<float>("mass").is_uniform());
}

TEST_CASE("removing no point copies nothing, removing all leaves an empty set with its attributes", "[point_set]")
{
    PointSet set = points({{0, 0, 0}, {1, 0, 0}}).set<float>("heat", {1, 2});
    const PointSet before = set;

    set.keep(std::vector<std::uint8_t>{1, 1});
    CHECK(set.P().shares_values_with(before.P()));

    set.keep(std::vector<std::uint8_t>{0, 0});
    CHECK(set.empty());
    CHECK(set.column<float>("heat").size() == 0);
    CHECK(before.size() == 2);
    CHECK(before.column<float>("heat")[1] == 2);
}

TEST_CASE("a copy of a set shares all columns, and writing one clones that one", "[point_set]")
{
    const PointSet original = points({{1, 2, 3}}).set<float>("heat", {5});
    PointSet copy = original;

    copy.column<float>("heat").write()[0] = 6;

    CHECK(copy.P().shares_values_with(original.P()));
    CHECK(original.column<float>("heat")[0] == 5);
    CHECK(copy.column<float>("heat")[0] == 6);
}

TEST_CASE("adding an attribute gives it to all points once, and never overwrites", "[point_set]")
{
    PointSet set = points({{0, 0, 0}, {1, 0, 0}});
    set.add({"heat", 0.25f});
    CHECK(set.column<float>("heat")[1] == 0.25f);
    CHECK(set.column<float>("heat").is_uniform());

    set.column<float>("heat").write()[1] = 9;
    set.add({"heat", 0.25f});
    CHECK(set.column<float>("heat")[1] == 9);
}

TEST_CASE("an attribute keeps its type", "[point_set]")
{
    PointSet set = points({{0, 0, 0}}).set<float>("heat", {1});

    CHECK_THROWS_WITH(set.add({"heat", Vec3f(0, 0, 0)}), "attribute \"heat\" is float already; it can't be vec3 too");
    CHECK_THROWS_WITH(set.column<std::int32_t>("heat"), "attribute \"heat\" is float; it must be int32");
    CHECK(set.find<Vec3f>("heat") == nullptr);
    CHECK(set.find<float>("heat") != nullptr);
}

TEST_CASE("an attribute that is not there is an error with the nearest name", "[point_set]")
{
    const PointSet set = points({{0, 0, 0}}).set<float>("heat", {1});
    CHECK_THROWS_WITH(set.column<float>("haet"), "no attribute \"haet\"; did you mean \"heat\"?");
    CHECK_THROWS_WITH(set.column<float>("colour"), "no attribute \"colour\"");
}

TEST_CASE("an attribute and a group that are removed are gone", "[point_set]")
{
    PointSet set = points({{0, 0, 0}}).set<float>("heat", {1}).group("hot", {0});
    set.remove("heat");
    set.remove_group("hot");
    set.remove_group("never there");
    CHECK_FALSE(set.has("heat"));
    CHECK(set.find_group("hot") == nullptr);
}

TEST_CASE("every known attribute is listed once, by name, with a type that Houdini gives it", "[point_set]")
{
    const auto& known = known_attributes();
    for (std::size_t i = 1; i < known.size(); ++i) CHECK(known[i - 1].name < known[i].name);

    CHECK(std::get<float>(known_attribute("mass")->fallback) == 1);
    CHECK(std::get<float>(known_attribute("life")->fallback) == std::numeric_limits<float>::infinity());
    CHECK(type_of(known_attribute("hittotal")->fallback) == AttributeType::Int32);
    CHECK(type_of(known_attribute("targetv")->fallback) == AttributeType::Vec3);
    CHECK(known_attribute("heat") == nullptr);
}

TEST_CASE("a set's bytes are those of its columns and groups", "[point_set]")
{
    PointSet set = points(std::vector<Vec3f>(1000, Vec3f(1, 2, 3)));
    // P takes 12 and id 8 bytes per point; v is uniform.
    CHECK(set.bytes() == 20 * 1000 + 12);
    set.group("hot").write();
    CHECK(set.bytes() == 21 * 1000 + 12);
}

TEST_CASE("the first points of a set have one value in columns that were written while it had none", "[point_set]")
{
    PointSet set = points(std::vector<Vec3f>{}).set<float>("heat", {});
    set.v().write();
    set.column<float>("heat").write();
    set.group("hot").write();
    set.append(0, {{"heat", 2.0f}}, {"hot"});
    set.append(1000, {{"heat", 2.0f}}, {"hot"});
    CHECK(set.v().is_uniform());
    CHECK(set.column<float>("heat").is_uniform());
    CHECK(set.column<float>("heat")[999] == 2.0f);
    CHECK(set.group("hot").is_uniform());
    CHECK(set.group("hot")[999] == 1);
}

TEST_CASE("a parameter is one number for all points, or an attribute that gives each its own", "[per_point]")
{
    const PointSet set = points({{0, 0, 0}, {1, 0, 0}}).set<float>("grip", {0.1f, 0.2f});

    const PerPoint<float> constant = 0.7f;
    CHECK(constant.read(set)[1] == 0.7f);

    const auto attribute = PerPoint<float>::of("grip");
    CHECK(attribute.read(set)[0] == 0.1f);
    CHECK(attribute.read(set)[1] == 0.2f);

    CHECK_THROWS_WITH(PerPoint<float>::of("gripp").read(set), "no attribute \"gripp\"; did you mean \"grip\"?");
}

}  // namespace rapid
