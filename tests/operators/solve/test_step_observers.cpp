#include "runtime/operators/solve/step_observers.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "tests/operators/node_test.h"

namespace rapid {
namespace {

using test::NodeTest;

// Points at these distances from an attractor, fed into a Solve with per-point figures.
struct Orbit {
    std::shared_ptr<Simulation> simulation = test::simulation();
    NodeTest pull{"attract", {{"strength", Value(20.0)}}};
    NodeTest solve;

    explicit Orbit(test::Arguments arguments) : solve("solve", std::move(arguments), simulation)
    {
        simulation->per_point_diagnostics = true;
    }
    PointSet step(const PointSet& points, std::int64_t frame = 2)
    {
        return solve.evaluate(frame, {pull.evaluate(frame, {Flow{points, {}, simulation}})}).points;
    }
};

PointSet at_distances(const std::vector<float>& distances)
{
    std::vector<Vec3f> positions;
    for (const float distance : distances) positions.emplace_back(distance, 0, 0);
    return test::points_at(positions);
}

TEST_CASE("a point's error is twice what twice the sub-steps move it by", "[solve][error]")
{
    const PointSet points = at_distances({0.5f, 0.7f, 1, 2, 5});
    Orbit coarse({{"substeps", Value(2.0)}}), fine({{"substeps", Value(4.0)}});
    const PointSet a = coarse.step(points), b = fine.step(points);
    const std::vector<float> error = test::values_of<float>(a, "error");
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double apart = (a.P()[i].cast<double>() - b.P()[i].cast<double>()).norm();
        CHECK(error[i] == Approx(2 * apart).margin(1e-12));
    }
    CHECK(error[0] > 10 * error[4]);
    CHECK(test::values_of<std::int32_t>(a, "substeps") == std::vector<std::int32_t>(5, 2));
    CHECK(test::values_of<std::int32_t>(a, "asleep") == std::vector<std::int32_t>(5, 0));
}

TEST_CASE("of paths in closed form the error is 0", "[solve][error]")
{
    const auto simulation = test::simulation();
    simulation->per_point_diagnostics = true;
    NodeTest gravity("gravity", {});
    NodeTest solve("solve", {}, simulation);
    const Flow flow = gravity.evaluate(2, {Flow{at_distances({1, 2}), {}, simulation}});
    CHECK(test::values_of<float>(solve.evaluate(2, {flow}).points, "error") == std::vector<float>{0, 0});
}

TEST_CASE("with a tolerance each point tells the sub-steps that it took, in order of id", "[solve][tolerance]")
{
    // Every second point is far away.
    std::vector<float> distances;
    for (int i = 0; i < 600; ++i) distances.push_back(i % 2 == 0 ? 0.3f : 50.0f);
    Orbit orbit({{"tolerance", Value(1e-5)}});
    const std::vector<std::int32_t> taken =
        test::values_of<std::int32_t>(orbit.step(at_distances(distances)), "substeps");
    int near = 0, far = 0;
    for (std::size_t i = 0; i < taken.size(); ++i) {
        CHECK(std::has_single_bit(static_cast<unsigned>(taken[i])));
        (i % 2 == 0 ? near : far) = std::max(i % 2 == 0 ? near : far, taken[i]);
    }
    CHECK(near >= 4 * far);
    CHECK(orbit.solve.figures.substeps == near);

    // The same point alone: the substeps of others do not matter.
    Orbit alone({{"tolerance", Value(1e-5)}});
    CHECK(test::values_of<std::int32_t>(alone.step(at_distances({50.0f})), "substeps").front() == taken[1]);
}

TEST_CASE("points without a shadow have no error", "[solve][error]")
{
    Orbit orbit({{"substeps", Value(2.0)}});
    std::vector<float> distances(5000, 1.0f);
    const std::vector<float> error = test::values_of<float>(orbit.step(at_distances(distances)), "error");
    const auto known = std::count_if(error.begin(), error.end(), [](float e) { return !std::isnan(e); });
    CHECK(known >= 1000);
    CHECK(known <= 1250);
    CHECK(static_cast<std::size_t>(known) == orbit.solve.figures.error.values.size());
}

TEST_CASE("the state does not keep the figures, and a scene's own attributes stay", "[solve]")
{
    PointSet points = at_distances({1, 2});
    points.add({"error", 7.0f});
    Orbit orbit({});
    const PointSet after = orbit.step(points);
    CHECK(test::values_of<float>(after, "error") == std::vector<float>{7, 7});
    CHECK(after.has("substeps"));
    CHECK_FALSE(orbit.simulation->state.has("substeps"));
    CHECK_FALSE(orbit.simulation->state.has("asleep"));

    Orbit unreported({});
    unreported.simulation->per_point_diagnostics = false;
    CHECK_FALSE(unreported.step(at_distances({1})).has("error"));
}

// Returns the points after four steps among attractors, neighbours and, with a radius, contacts; some die of age. Uses
// all observers that a step can have, or only the permanent ones.
PointSet after_steps(const test::Arguments& arguments, double radius_of_contacts, bool is_observed)
{
    const auto simulation = test::simulation();
    simulation->per_point_diagnostics = simulation->estimates_errors = is_observed;
    if (is_observed) simulation->record = std::make_shared<StepRecord>();
    NodeTest pull("attract", {{"strength", Value(20.0)}}, simulation);
    NodeTest neighbours("interact", {{"radius", Value(1.0)}, {"separation", Value(30.0)}}, simulation);
    NodeTest contact("contact", {{"radius", Value(radius_of_contacts)}}, simulation);
    NodeTest solve("solve", arguments, simulation);
    PointSet points = at_distances({0.5f, 0.7f, 1, 2, 2.1f, 5});
    points.add({"age", 0.0f});
    points.set("life", Column<float>(std::span<const float>(std::vector<float>{1, 1, 1, 0.1f, 1, 1})));
    for (std::int64_t frame = 2; frame <= 5; ++frame) {
        Flow flow = neighbours.evaluate(frame, {pull.evaluate(frame, {Flow{points, {}, simulation}})});
        if (radius_of_contacts > 0) flow = contact.evaluate(frame, {std::move(flow)});
        points = solve.evaluate(frame, {std::move(flow)}).points;
    }
    return points;
}

TEST_CASE("observers find out about a step and leave its points as they are", "[solve]")
{
    const auto same = [](const test::Arguments& arguments, double radius_of_contacts = 0) {
        const PointSet observed = after_steps(arguments, radius_of_contacts, true);
        const PointSet alone = after_steps(arguments, radius_of_contacts, false);
        CHECK(observed.size() == 5);
        CHECK(observed.has("error"));
        CHECK_FALSE(alone.has("error"));
        CHECK(test::ids_of(observed) == test::ids_of(alone));
        for (const char* name : {"P", "v"})
            CHECK(test::values_of<Vec3f>(observed, name) == test::values_of<Vec3f>(alone, name));
    };
    same({});
    same({{"substeps", Value(3.0)}});
    same({{"tolerance", Value(1e-4)}});
    same({}, 0.1);
    same({{"substeps", Value(3.0)}}, 0.1);
}

// Kills points beyond the limit.
class Border : public Action {
public:
    std::unique_ptr<ActionPass> begin(PointSet&) const override { return std::make_unique<Pass>(); }

private:
    struct Pass : ActionPass {
        void act(const Chunk& chunk, std::span<Vec3d>, std::span<std::uint8_t> dead) override
        {
            for (std::size_t i = 0; i < dead.size(); ++i) dead[i] |= chunk.P[i].x() > 0.9;
        }
    };
};

TEST_CASE("a record has the deaths of the step, and none of the runs that measure stiffness", "[solve]")
{
    const auto simulation = test::simulation();
    simulation->record = std::make_shared<StepRecord>();
    NodeTest pull("attract", {{"strength", Value(2000.0)}}, simulation);
    NodeTest solve("solve", {}, simulation);
    Flow flow = pull.evaluate(2, {Flow{at_distances({0.5f, 1, 2}), {}, simulation}});
    flow.dynamics.add(std::shared_ptr<const Action>(std::make_shared<Border>()));
    solve.evaluate(2, {std::move(flow)});
    REQUIRE_FALSE(solve.figures.stiff.empty());
    CHECK(simulation->record->killed_at.size() == simulation->record->killed.size());
}

}  // namespace
}  // namespace rapid
