#include "runtime/graph/attribute_uses.h"

#include <cmath>

#include "runtime/graph/evaluate.h"
#include "tests/graph/graph_under_test.h"

namespace rapid {
namespace {

using test::error_of;
using test::GraphUnderTest;
using test::points;
using test::same_bits;

const Uses nothing;

TEST_CASE("undeclared columns are poisoned, and restored afterwards", "[declarations]")
{
    PointSet set = points({{1, 2, 3}, {4, 5, 6}}).set<float>("heat", {0.5f, 0.25f}).group("hot", {1});
    const PointSet before = set;
    const UndeclaredColumns undeclared(set, {&nothing, 1});
    CHECK(std::isnan(set.column<float>("heat")[0]));
    CHECK(set.group("hot")[0] != 0);
    CHECK(same_bits(set.P(), before.P()));

    undeclared.restore(set);
    CHECK(same_bits(set.column<float>("heat"), before.column<float>("heat")));
    CHECK(same_bits(set.group("hot"), *before.find_group("hot")));
}

TEST_CASE("values go back to the points that are left, and newborn points keep theirs", "[declarations]")
{
    PointSet set = points({{1, 0, 0}, {2, 0, 0}, {3, 0, 0}}).set<float>("heat", {1, 2, 3});
    const UndeclaredColumns undeclared(set, {&nothing, 1});
    const std::vector<std::uint8_t> kept = {1, 0, 1};
    set.keep(kept);
    set.append(1);
    set.id().write()[2] = 3;
    set.column<float>("heat").write()[2] = 9;
    undeclared.restore(set);
    CHECK(same_bits(set.column<float>("heat"), Column<float>(std::span<const float>(std::vector<float>{1, 3, 9}))));
}

TEST_CASE("declared columns stay as they are", "[declarations]")
{
    PointSet set = points({{1, 0, 0}}).set<float>("heat", {1}).set<float>("cold", {2}).group("hot", {0});
    Uses uses;
    uses.reads = {"heat"};
    uses.takes_groups = {"hot"};
    const UndeclaredColumns undeclared(set, {&uses, 1});
    CHECK(set.column<float>("heat")[0] == 1);
    CHECK(std::isnan(set.column<float>("cold")[0]));
    CHECK(set.group("hot")[0] == 1);

    PointSet all = points({{1, 0, 0}}).set<float>("heat", {1});
    uses = {};
    uses.reads_all = true;
    const UndeclaredColumns none(all, {&uses, 1});
    CHECK(all.column<float>("heat")[0] == 1);
}

TEST_CASE("a node that uses an undeclared column is an error with its name", "[declarations]")
{
    const auto [what, message] = GENERATE(table<std::string, std::string>({
        {"nothing", ""},
        {"reads", "scene.lua:3: node \"undeclared1\": it reads a column that it does not declare: \"P\" depends on it"},
        {"writes", "scene.lua:3: node \"undeclared1\": it writes \"heat\", which it does not declare"},
    }));
    GraphUnderTest scene;
    const NodePtr source = scene.node("source");
    const NodePtr heat = scene.node("make", {source}, {{"heat", Value(0.5)}});
    const NodePtr node = scene.node("undeclared", {heat}, {{"what", Value(what)}});
    const Plan plan(scene.returning(scene.node("post", {node})), {});
    Evaluator evaluator(plan);
    evaluator.check_declarations();
    CHECK(error_of([&] { evaluator.advance(), evaluator.advance(); }) == message);
}

}  // namespace
}  // namespace rapid
