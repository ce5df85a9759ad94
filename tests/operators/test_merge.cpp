#include "runtime/graph/simulation.h"
#include "tests/operators/graph_test.h"
#include "tests/solver/motion/uniform_force.h"

namespace rapid {

using namespace test;

namespace {

// Returns a flow of a simulation whose next birth gets the id `next_id`.
Flow flow_of(const std::shared_ptr<Simulation>& in, PointSet points, std::int64_t next_id)
{
    in->next_id = next_id;
    return {std::move(points), {}, in};
}

PointSet with_ids(std::vector<std::int64_t> ids)
{
    PointSet points;
    points.append(ids.size());
    points.id() = Column<std::int64_t>(std::span<const std::int64_t>(ids));
    const auto P = points.P().write();
    for (std::size_t i = 0; i < ids.size(); ++i) P[i] = Vec3f(static_cast<float>(ids[i]), 0, 0);
    return points;
}

using Ids = std::vector<std::int64_t>;

}  // namespace

TEST_CASE("a point of both inputs is taken once, from the first", "[merge]")
{
    const auto one = simulation();
    PointSet first = with_ids({0, 2, 5}), second = with_ids({1, 2, 3, 5});
    first.set("heat", Column<float>(3, 1.0f));
    second.set("heat", Column<float>(4, 2.0f));
    NodeTest merge("merge", {});
    const Flow merged = merge.evaluate(2, {flow_of(one, first, 6), flow_of(one, second, 6)});
    CHECK(ids_of(merged.points) == Ids{0, 2, 5, 1, 3});
    CHECK(values_of<float>(merged.points, "heat") == std::vector<float>{1, 1, 1, 2, 2});
    CHECK(one->next_id == 6);
}

TEST_CASE("points of another simulation get new ids, and keep them from frame to frame", "[merge]")
{
    const auto here = simulation(), there = simulation();
    NodeTest merge("merge", {});
    const auto ids_at = [&](std::int64_t frame, Ids first, Ids second) {
        return ids_of(merge.evaluate(frame, {{with_ids(first), {}, here}, {with_ids(second), {}, there}}).points);
    };
    here->next_id = 3;
    CHECK(ids_at(2, {0, 1, 2}, {0, 1}) == Ids{0, 1, 2, 3, 4});

    // One birth here takes 5; there, 2 and 3 are born and 0 is dead.
    here->next_id = 6;
    CHECK(ids_at(3, {0, 1, 2, 5}, {1, 2, 3}) == Ids{0, 1, 2, 5, 4, 6, 7});
    CHECK(ids_at(4, {0, 1, 2, 5}, {3}) == Ids{0, 1, 2, 5, 7});
    CHECK(here->next_id == 8);
    CHECK(there->next_id == 0);
}

TEST_CASE("a point of another simulation in both inputs is taken once, also through several merges", "[merge]")
{
    const auto here = simulation(), there = simulation();
    NodeTest merge("merge", {});
    const Flow once = merge.evaluate(2, {flow_of(here, with_ids({0}), 1), {with_ids({0, 1}), {}, there}});
    NodeTest again("merge", {}, "merge2");
    const Flow twice = again.evaluate(2, {once, {with_ids({1, 2}), {}, there}, {with_ids({2}), {}, there}});
    CHECK(ids_of(twice.points) == Ids{0, 1, 2, 3});
    CHECK(values_of<Vec3f>(twice.points, "P") == std::vector<Vec3f>{{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {2, 0, 0}});
}

TEST_CASE("the result has the columns and groups of both, with fallbacks where a point has none", "[merge]")
{
    const auto here = simulation(), there = simulation();
    PointSet first = with_ids({0}), second = with_ids({0, 1});
    first.add({"heat", 1.0f});
    first.group("left").fill(1);
    second.add({"Cd", Vec3f(0, 1, 0)});
    second.set("pscale", Column<float>(std::span<const float>(std::vector<float>{3, 4}), 0.5f));
    second.group("right").write()[1] = 1;
    const PointSet merged =
        NodeTest("merge", {}).evaluate(2, {flow_of(here, first, 1), flow_of(there, second, 2)}).points;

    CHECK(values_of<float>(merged, "heat") == std::vector<float>{1, 1, 1});
    CHECK(values_of<Vec3f>(merged, "Cd") == std::vector<Vec3f>(3, Vec3f(0, 1, 0)));
    CHECK(values_of<float>(merged, "pscale") == std::vector<float>{0.5f, 3, 4});
    const auto& left = *merged.find_group("left");
    const auto& right = *merged.find_group("right");
    CHECK((left[0] == 1 && left[1] == 0 && left[2] == 0));
    CHECK((right[0] == 0 && right[1] == 0 && right[2] == 1));
}

TEST_CASE("uniform columns of one value stay uniform", "[merge]")
{
    const auto here = simulation(), there = simulation();
    PointSet first = with_ids({0}), second = with_ids({0, 1});
    for (PointSet* set : {&first, &second}) {
        set->set("pscale", Column<float>(set->size(), 0.1f, /*fallback=*/0.0f));
        set->group("all").fill(1);
    }
    const PointSet merged =
        NodeTest("merge", {}).evaluate(2, {flow_of(here, first, 1), flow_of(there, second, 2)}).points;
    CHECK(merged.column<float>("pscale").is_uniform());
    CHECK(merged.find_group("all")->is_uniform());
    CHECK(merged.column<float>("pscale")[2] == 0.1f);
    CHECK((*merged.find_group("all"))[2] == 1);
}

TEST_CASE("forces of both inputs are merged, and common ones are kept once", "[merge]")
{
    const auto one = simulation();
    const auto make = [] { return std::make_shared<Collider>(); };
    const auto shared = make(), left = make(), right = make();
    const auto merged = NodeTest("merge", {})
                            .evaluate(2, {{{}, test::chain(shared, left), one}, {{}, test::chain(shared, right), one}});
    CHECK(merged.dynamics.colliders() == Dynamics::List<Collider>{shared, left, right});
}

TEST_CASE("the initial points of all inputs are there at the first frame", "[merge]")
{
    const auto here = simulation(), there = simulation();
    NodeTest merge("merge", {});
    CHECK(merge.start({flow_of(here, with_ids({0}), 1), flow_of(there, with_ids({0, 1}), 2)}).points.size() == 3);
}

TEST_CASE("merged before Solve, each point of another create is adopted once and then fed back", "[merge]")
{
    GraphTest graph;
    const auto place = [](float x) { return ObjectPtr(source_of(points_at({{x, 0, 0}}))); };
    const auto here = graph.node("create", {{"points", place(1)}});
    const auto there = graph.node("create", {{"points", place(2)}});
    const auto born = graph.node("emit", {{"source", place(3)}, {"count", 1.0}}, {there});
    graph.run(graph.node("hold", {}, {graph.node("merge", {}, {here, born})}));

    CHECK(values_of<Vec3f>(graph.next_frame(), "P") == std::vector<Vec3f>{{1, 0, 0}, {2, 0, 0}});
    CHECK(values_of<Vec3f>(graph.next_frame(), "P") == std::vector<Vec3f>{{1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
    const PointSet third = graph.next_frame();
    CHECK(third.size() == 4);
    CHECK(ids_of(third) == Ids{0, 1, 2, 3});
}

TEST_CASE("merged after Solve, both simulations continue independently", "[merge]")
{
    GraphTest graph;
    const Value place = ObjectPtr(source_of(points_at({{0, 0, 0}})));
    std::vector<NodePtr> solved;
    for (int i = 0; i < 2; ++i)
        solved.push_back(
            graph.node("hold", {}, {graph.node("emit", {{"source", place}, {"count", 1.0}}, {graph.node("create")})}));
    graph.run(graph.node("merge", {}, solved));

    CHECK(graph.next_frame().empty());
    CHECK(ids_of(graph.next_frame()) == Ids{0, 1});
    // The first simulation's second birth takes the next free id, and the other's points keep theirs.
    CHECK(ids_of(graph.next_frame()) == Ids{0, 2, 1, 3});
    CHECK(ids_of(graph.next_frame()) == Ids{0, 2, 4, 1, 3, 5});
}

TEST_CASE("inputs may be empty, and there may be only one", "[merge][extreme]")
{
    const auto here = simulation(), there = simulation();
    NodeTest merge("merge", {});
    CHECK(merge.evaluate(2, {flow_of(here, {}, 0), flow_of(there, {}, 0)}).points.empty());
    CHECK(merge.evaluate(2, {flow_of(here, {}, 0), flow_of(there, with_ids({0}), 1)}).points.size() == 1);
    CHECK(merge.evaluate(2, {flow_of(here, with_ids({0}), 1)}).points.size() == 1);
}

TEST_CASE("merge refuses incompatible inputs, and names the input", "[merge]")
{
    PointSet floats = with_ids({0}), vectors = with_ids({0});
    floats.add({"heat", 1.0f});
    vectors.add({"heat", Vec3f(1, 0, 0)});
    const auto merge = [](Flow a, Flow b) {
        return error_of([&] { NodeTest("merge", {}).evaluate(2, {std::move(a), std::move(b)}); });
    };
    CHECK(merge(flow_of(simulation(), floats, 1), flow_of(simulation(), vectors, 1)) ==
          "input 2: attribute \"heat\" is float already; it can't be vec3 too");
    CHECK(merge(flow_of(simulation(24), {}, 0), flow_of(simulation(30), {}, 0)) ==
          "input 2: it runs at 30 frames per second and input 1 at 24; give both the same fps");
}

TEST_CASE("adopted ids are unique per point, whatever the order in which points appear", "[merge]")
{
    AdoptedIds adopted;
    std::map<std::int64_t, std::int64_t> known;
    std::int64_t next = 100, expected_next = 100;
    bool all_right = true;
    for (std::int64_t i = 0; i < 5000; ++i) {
        const std::int64_t id = i * i * 7919 % 1009;
        const auto [place, fresh] = known.emplace(id, expected_next);
        expected_next += fresh;
        all_right &= adopted.of(id, next) == place->second && next == expected_next;
    }
    CHECK(all_right);
}

TEST_CASE("consecutive ids take the memory of their runs", "[merge]")
{
    AdoptedIds adopted;
    std::int64_t next = 0;
    for (std::int64_t id = 0; id < 100000; ++id) adopted.of(id, next);
    CHECK(adopted.runs() == 1);
    next += 10;  // births of the simulation itself
    for (std::int64_t id = 100000; id < 200000; ++id) adopted.of(id, next);
    CHECK(adopted.runs() == 2);
}

TEST_CASE("merge drops pruned attributes", "[merge]")
{
    const auto here = simulation(), there = simulation();
    here->next_id = 1;
    PointSet other = points_at({{1, 0, 0}});
    other.add({"heat", 1.0f});
    other.add({"wet", 1.0f});
    other.group("hot");
    NodeTest merge("merge", {}, here);
    merge.pruned = {"heat", "group:hot"};
    const PointSet both = merge.evaluate(2, {Flow{points_at({{0, 0, 0}}), {}, here}, Flow{other, {}, there}}).points;
    CHECK(both.size() == 2);
    CHECK(both.column_names() == std::vector<std::string>{"P", "id", "v", "wet"});
    CHECK(both.group_names().empty());
}

}  // namespace rapid
