#include "tests/operators/node_test.h"

namespace rapid {
namespace {

using test::NodeTest;

const Force& force_of(const Flow& flow)
{
    REQUIRE(flow.dynamics.size() == 1);
    REQUIRE(flow.dynamics.forces().size() == 1);
    return *flow.dynamics.forces()[0];
}

TEST_CASE("gravity changes no point, and adds one acceleration for all", "[gravity]")
{
    NodeTest gravity("gravity", {});
    const Flow flow = gravity.evaluate(2, {Flow{test::points_at({{0, 1, 0}}), {}, test::simulation()}});
    CHECK(flow.points.P()[0] == Vec3f(0, 1, 0));
    CHECK(flow.points.v()[0] == Vec3f(0, 0, 0));
    CHECK(force_of(flow).uniform()->a == Vec3d(0, -9.81, 0));
    CHECK(force_of(flow).node == "gravity1");
    CHECK(force_of(flow).group.empty());
}

TEST_CASE("gravity may change with the frame, and act on a group", "[gravity]")
{
    NodeTest gravity("gravity",
                     {{"g", test::of_frame([](const Frame& frame) { return Value(Vec3d(frame.number, 0, 0)); })},
                      {"group", Value("heavy")}});
    const Flow flow = gravity.evaluate(5, {Flow{PointSet(), {}, test::simulation()}});
    CHECK(force_of(flow).uniform()->a == Vec3d(5, 0, 0));
    CHECK(force_of(flow).group == "heavy");
    CHECK(gravity.uses().reads_groups == std::vector<std::string>{"heavy"});
}

}  // namespace
}  // namespace rapid
