#include "runtime/shapes/analytic/analytic.h"
#include "tests/operators/node_test.h"

namespace rapid {
namespace {

using test::Arguments;
using test::error_of;
using test::NodeTest;

Value floor_plane() { return Value(ObjectPtr(make_plane({0, 1, 0}, 0))); }

Flow collided(const Arguments& arguments)
{
    NodeTest collide("collide", arguments);
    return collide.evaluate(2, {Flow{test::points_at({{0, -1, 0}}), {}, test::simulation()}});
}

const Collider& collider_of(const Flow& flow)
{
    REQUIRE(flow.dynamics.size() == 1);
    REQUIRE(flow.dynamics.colliders().size() == 1);
    return *flow.dynamics.colliders()[0];
}

TEST_CASE("collide changes no point, and adds its shape to what Solve applies", "[collide]")
{
    const Value plane = floor_plane();
    const Flow flow = collided({{"shape", plane}});
    const Collider& collider = collider_of(flow);

    CHECK(flow.points.P()[0] == Vec3f(0, -1, 0));
    CHECK(collider.shape == plane.object<Shape>());
    CHECK(collider.node == "collide1");
    CHECK(collider.bounce.constant == 0.5f);
    CHECK(collider.friction.constant == 0.0f);
    CHECK_FALSE(collider.radius);
    CHECK(collider.group.empty());
}

TEST_CASE("bounce, friction and radius may be attributes", "[collide]")
{
    const Flow flow = collided({{"shape", floor_plane()},
                                {"bounce", Value(AttributeRef{"elasticity"})},
                                {"friction", Value(0.25)},
                                {"radius", Value(AttributeRef{"size"})},
                                {"group", Value("solid")}});
    const Collider& collider = collider_of(flow);
    CHECK(collider.bounce.attribute == "elasticity");
    CHECK(collider.friction.constant == 0.25f);
    REQUIRE(collider.radius);
    CHECK(collider.radius->attribute == "size");
    CHECK(collider.group == "solid");
}

TEST_CASE("collide refuses illegal arguments, and quotes them", "[collide]")
{
    CHECK_THAT(error_of([] { collided({}); }), Catch::StartsWith("shape is missing"));
    CHECK_THAT(error_of([] {
                   collided({{"shape", floor_plane()}, {"bounce", Value(1.4)}});
               }),
               Catch::Contains("bounce = 1.4 is out of range; it must be from 0 to 1"));
    CHECK_THAT(error_of([] {
                   collided({{"shape", floor_plane()}, {"friction", Value(-1.0)}});
               }),
               Catch::Contains("friction = -1 is out of range; it must be at least 0"));
    CHECK_THAT(error_of([] { collided({{"shape", Value(3.0)}}); }), Catch::Contains("shape"));
}

}  // namespace
}  // namespace rapid
