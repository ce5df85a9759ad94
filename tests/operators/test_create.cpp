#include "tests/operators/node_test.h"

namespace rapid {

using namespace test;

namespace {

Value initial(PointSet points) { return ObjectPtr(source_of(std::move(points))); }

}  // namespace

TEST_CASE("create yields the initial points at the first frame, with ids from 0 in their order", "[create]")
{
    PointSet brought = points_at({{1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
    brought.id() = Column<std::int64_t>(std::span<const std::int64_t>(std::vector<std::int64_t>{7, 7, -1}));
    NodeTest create("create", {{"points", initial(brought)}});

    const PointSet points = create(1);
    CHECK(ids_of(points) == std::vector<std::int64_t>{0, 1, 2});
    CHECK(points.P()[2] == Vec3f(3, 0, 0));
    CHECK(create.simulation_state().next_id == 3);
}

TEST_CASE("create yields what Solve left at every later frame, without a copy", "[create]")
{
    NodeTest create("create", {});
    create.simulation_state().state = points_at({{1, 2, 3}, {4, 5, 6}});
    const Vec3f* memory = create.simulation_state().state.P().read().data;

    const PointSet points = create(2);
    CHECK(points.size() == 2);
    CHECK(points.P().read().data == memory);
    CHECK(create.simulation_state().state.empty());
}

TEST_CASE("every planned column and group exists from the first frame on", "[create]")
{
    const std::int64_t frame = GENERATE(1, 2);
    NodeTest create("create", {{"points", initial(points_at({{0, 0, 0}}))}});
    create.simulation_state().state = points_at({{0, 0, 0}});
    create.simulation_state().columns = {{"heat", 2.0f}, {"Cd", Vec3f(1, 0, 0)}};
    create.simulation_state().groups = {"hot"};

    const PointSet points = create(frame);
    CHECK(points.column<float>("heat")[0] == 2);
    CHECK(points.column<Vec3f>("Cd")[0] == Vec3f(1, 0, 0));
    REQUIRE(points.find_group("hot"));
    CHECK((*points.find_group("hot"))[0] == 0);
}

TEST_CASE("a fallback that changes with the frame applies to later points, not to existing ones", "[create]")
{
    NodeTest create("create", {});
    PointSet state = points_at({{0, 0, 0}});
    state.add({"heat", 2.0f});
    create.simulation_state().state = state;
    create.simulation_state().columns = {{"heat", 5.0f}};

    PointSet points = create(2);
    points.append(1);
    CHECK(values_of<float>(points, "heat") == std::vector<float>{2, 5});
}

TEST_CASE("initial points keep their attributes and groups, which create declares", "[create]")
{
    PointSet brought = points_at({{0, 0, 0}, {1, 0, 0}});
    brought.set("heat", Column<float>(std::span<const float>(std::vector<float>{5, 6})));
    brought.group("left").write()[0] = 1;
    NodeTest create("create", {{"points", initial(brought)}});

    CHECK(values_of<float>(create(1), "heat") == std::vector<float>{5, 6});
    const Uses uses = create.uses();
    REQUIRE(uses.makes.size() == 1);
    CHECK(uses.makes[0].name == "heat");
    CHECK(uses.makes_groups == std::vector<std::string>{"left"});
}

TEST_CASE("a simulation may begin with no points", "[create][extreme]")
{
    NodeTest create("create", {});
    CHECK(create(1).empty());
    CHECK(create(2).empty());
}

TEST_CASE("create refuses illegal frame rates, and known attributes of another type", "[create]")
{
    CHECK(error_of([] { NodeTest("create", {{"fps", 0.0}}); }) == "fps = 0 is out of range; it must be above 0");
    CHECK(error_of([] { NodeTest("create", {{"start", 1.5}}); }) == "start = 1.5 is not whole; it must be an integer");
    PointSet wrong = points_at({{0, 0, 0}});
    wrong.add({"pscale", Vec3f(1, 1, 1)});
    CHECK(error_of([&] {
              NodeTest("create", {{"points", initial(wrong)}});
          }) == "the initial points have \"pscale\" as vec3; it must be float");
}

TEST_CASE("create drops pruned attributes of the initial points", "[create]")
{
    PointSet points = points_at({{0, 0, 0}});
    points.add({"heat", 1.0f});
    points.add({"wet", 1.0f});
    points.group("left");
    points.group("right");
    NodeTest create("create", {{"points", ObjectPtr(source_of(points))}});
    create.pruned = {"heat", "group:left"};
    const PointSet initial = create(1);
    CHECK(initial.column_names() == std::vector<std::string>{"P", "id", "v", "wet"});
    CHECK(initial.group_names() == std::vector<std::string>{"right"});
}

}  // namespace rapid
