#include <cmath>

#include "runtime/shapes/level_set/level_set.h"
#include "runtime/solver/constraints/constraint.h"
#include "tests/operators/node_test.h"

namespace rapid {
namespace {

using test::NodeTest;
using test::points_at;

constexpr double frame_length = 1.0 / 24;

// Returns points at the input of a Solve, with a simulation's gravity.
Flow falling(PointSet points, const std::shared_ptr<Simulation>& simulation)
{
    NodeTest gravity("gravity", {});
    return gravity.evaluate(2, {Flow{std::move(points), {}, simulation}});
}

TEST_CASE("solve advances the points by a frame, and feeds them back to Create", "[solve]")
{
    const auto simulation = test::simulation();
    NodeTest solve("solve", {});
    const Flow flow = solve.evaluate(2, {falling(points_at({{0, 10, 0}}), simulation)});

    CHECK(flow.points.P()[0].y() == Approx(10 - 9.81 * frame_length * frame_length / 2).epsilon(1e-7));
    CHECK(flow.points.v()[0].y() == Approx(-9.81 * frame_length).epsilon(1e-6));
    CHECK(flow.dynamics.empty());
    CHECK(simulation->state.P().shares_values_with(flow.points.P()));
    CHECK(simulation->state.size() == 1);
    CHECK(solve.figures.substeps == 1);
}

TEST_CASE("at the first frame solve only passes the points on", "[solve]")
{
    const auto simulation = test::simulation();
    NodeTest solve("solve", {});
    const Flow flow = solve.start({falling(points_at({{0, 10, 0}}), simulation)});
    CHECK(flow.points.P()[0] == Vec3f(0, 10, 0));
    CHECK(flow.dynamics.empty());
    CHECK(simulation->state.size() == 1);
}

TEST_CASE("points age by their own time, and die at their life", "[solve]")
{
    PointSet points = points_at({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}});
    const auto floats = [](std::vector<float> values) { return Column<float>(std::span<const float>(values)); };
    const float frame = frame_length;
    points.set("age", floats({0, 0, 1, 1}));
    points.set("dt", floats({frame, 0.01f, frame, frame}));
    points.set("life", floats({10, 10, 1 + 0.5f * frame, 1 + 2 * frame}));
    NodeTest solve("solve", {});
    const PointSet after = solve(2, points);

    CHECK(test::ids_of(after) == std::vector<std::int64_t>{0, 1, 3});
    CHECK(test::values_of<float>(after, "age") == std::vector<float>{frame, 0.01f, 1 + frame});
    CHECK_FALSE(after.has("dt"));
    CHECK(solve.figures.died == 1);
    CHECK(solve.simulation_state().state.size() == 3);
}

TEST_CASE("a life of 0 ends with the first frame, an infinite one never", "[solve][extreme]")
{
    PointSet points = points_at({{0, 0, 0}, {1, 0, 0}});
    const std::vector<float> lives = {0, std::numeric_limits<float>::infinity()};
    points.add({"age", 0.0f});
    points.set("life", Column<float>(std::span<const float>(lives)));
    NodeTest solve("solve", {});
    CHECK(test::ids_of(solve(2, points)) == std::vector<std::int64_t>{1});
}

TEST_CASE("without life nothing dies, and without age nothing ages", "[solve]")
{
    PointSet points = points_at({{0, 0, 0}});
    NodeTest solve("solve", {});
    CHECK(solve(2, points).column_names() == std::vector<std::string>{"P", "id", "v"});
    points.add({"age", 5.0f});
    CHECK(test::values_of<float>(solve(2, points), "age") == std::vector<float>{5 + float(frame_length)});
    CHECK(solve.figures.died == 0);
}

TEST_CASE("only points of the group of solve move and age", "[solve]")
{
    PointSet points = points_at({{0, 0, 0}, {1, 0, 0}});
    points.add({"age", 0.0f});
    points.group("awake").write()[1] = 1;
    const auto simulation = test::simulation();
    NodeTest solve("solve", {{"group", Value("awake")}});
    const PointSet after = solve.evaluate(2, {falling(points, simulation)}).points;
    CHECK(after.P()[0] == Vec3f(0, 0, 0));
    CHECK(after.P()[1].y() < 0);
    CHECK(test::values_of<float>(after, "age") == std::vector<float>{0, float(frame_length)});
}

TEST_CASE("columns that are not shared are not copied from frame to frame", "[solve]")
{
    const auto simulation = test::simulation();
    NodeTest solve("solve", {});
    Flow flow = solve.evaluate(2, {falling(points_at({{0, 10, 0}, {0, 20, 0}}), simulation)});
    const Vec3f* P = flow.points.P().read().data;
    const Vec3f* v = flow.points.v().read().data;
    flow = {};  // like a released result of a frame
    for (int f = 3; f < 6; ++f) {
        PointSet state = std::move(simulation->state);  // like Create
        std::vector<Flow> inputs(1);                    // an initializer list would hold a second copy
        inputs[0] = falling(std::move(state), simulation);
        flow = solve.evaluate(f, std::move(inputs));
        CHECK(flow.points.P().read().data == P);
        CHECK(flow.points.v().read().data == v);
        flow = {};
    }
}

TEST_CASE("the band of a level set is as wide as the largest radius needs", "[solve]")
{
    // A band of 0.15 m, and points of 0.4 m.
    const LevelSetPtr ball = level_set_sphere(1, {0, 0, 0}, {0.05, 3});
    PointSet points = points_at({{0, 1.6f, 0}, {0, 1.5f, 0.5f}});
    points.add({"pscale", 0.4f});
    const auto simulation = test::simulation();
    NodeTest collide("collide", {{"shape", Value(ObjectPtr(ball))}, {"bounce", Value(0.0)}, {"friction", Value(10.0)}});
    NodeTest solve("solve", {});
    for (int f = 2; f < 50; ++f) {
        Flow flow = collide.evaluate(f, {falling(points, simulation)});
        points = solve.evaluate(f, {std::move(flow)}).points;
    }
    // A level set with voxels of 5 cm has an error of (5 cm)²/(8 · 1.4 m).
    for (std::size_t i = 0; i < 2; ++i) CHECK(points.P()[i].norm() == Approx(1.4).margin(5e-4));
    CHECK(solve.figures.penetration_max < 1e-6);
}

// Claims to act by impulses between points, but multiplies the velocity of one: in the substeps, or after them.
class Leak : public Constraint, public Coupling {
public:
    double in_substeps = 1, after = 1;

    std::shared_ptr<Coupling> begin(const PointSet&, double) const override { return std::make_shared<Leak>(*this); }
    bool keeps_momentum() const override { return true; }
    void project(Substep&) override {}
    void solve_velocities(Substep& step) override { step.v[0] *= in_substeps; }
    void close(Substep& step, FrameFigures&) override { step.v[0] *= after; }
};

TEST_CASE("energy or momentum that nothing accounts for is a warning with its size", "[solve][ledger]")
{
    PointSet points = points_at({{0, 0, 0}, {1, 0, 0}});
    for (const std::size_t i : {0, 1}) points.v().write()[i] = {2, 0, 0};
    const auto warnings = [&](double in_substeps, double after) {
        auto leak = std::make_shared<Leak>();
        leak->node = "leak1";
        leak->in_substeps = in_substeps;
        leak->after = after;
        Flow flow{points, {}, test::simulation()};
        flow.dynamics.add(std::move(leak));
        NodeTest solve("solve", {});
        solve.evaluate(2, {std::move(flow)});
        return solve.warnings;
    };
    // Each of the two has half of the momentum and of the energy.
    CHECK(warnings(1, 1).empty());
    CHECK(warnings(0.99, 1) ==
          std::vector<std::string>{"node \"solve1\": constraints changed the energy by 0.0e+00 and the momentum by "
                                   "5.0e-03 of their amounts without a cause; give more substeps or iterations"});
    const std::vector<std::string> of_energy = warnings(1, 1.1);  // (1.1² - 1) / (1.1² + 1), (1.1 - 1) / (1.1 + 1)
    REQUIRE(of_energy.size() == 1);
    CHECK(of_energy[0].find("changed the energy by 9.5e-02 and the momentum by 4.8e-02") != std::string::npos);
}

TEST_CASE("substeps below 1 are refused", "[solve]")
{
    CHECK(test::error_of([] {
              NodeTest("solve", {{"substeps", Value(0.0)}});
          }) == "substeps = 0 is out of range; it must be from 1 to 1048576");
}

}  // namespace
}  // namespace rapid
