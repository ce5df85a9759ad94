#include "runtime/solver/collision/slide.h"

#include <cmath>

#include "tests/solver/scene.h"
#include "tests/test.h"

namespace rapid {
namespace {

using test::close_to;

using test::g;

Support support(const Vec3d& normal, double friction)
{
    Support on;
    on.n = normal.normalized();
    on.friction = friction;
    on.flat = true;
    return on;
}

TEST_CASE("static friction holds a point up to μ times the normal force", "[slide]")
{
    const double pull = GENERATE(0.0, 0.99, 1.01);  // relative to friction
    const Slide slide = slide_on(support({0, 1, 0}, 0.5), Vec3d::Zero(), {pull * 0.5 * g, -g, 0}, 1, 0);
    CHECK(slide.kind == (pull > 1 ? Slide::Moves : Slide::Sticks));
    if (pull > 1) CHECK_THAT(slide.a, close_to(Vec3d(0.01 * 0.5 * g, 0, 0), 1e-12));
}

TEST_CASE("sliding friction stops a point after v/(μ g)", "[slide]")
{
    const Slide slide = slide_on(support({0, 1, 0}, 0.25), {0, 0, -2}, {0, -g, 0}, 10, 0);
    CHECK(slide.kind == Slide::Moves);
    CHECK(slide.stops);
    CHECK(slide.duration == Approx(2 / (0.25 * g)));
    CHECK_THAT(slide.a, close_to(Vec3d(0, 0, 0.25 * g), 1e-12));
}

// The point is so slow that friction turns within the shortest piece. The final velocity of a piece uses the mean of
// the accelerations at both ends, as along curved surfaces.
TEST_CASE("a slow point moves in the direction of the pull, and not back and forth across it", "[slide]")
{
    const double excess = GENERATE(0.02, 0.1), turn = GENERATE(0.5, 1.5, 2.5);  // m/s² over friction; rad
    CAPTURE(excess, turn);
    const Support on = support({0, 1, 0}, 0.3);
    const Vec3d pull(0.3 * g + excess, -g, 0);
    const double time = 1.0 / 48, speed = 4e-5;
    Vec3d v = speed * Vec3d(std::cos(turn), 0, std::sin(turn));
    int pieces = 0;
    for (double left = time; left > 0 && pieces < 1000; ++pieces) {
        const Slide slide = slide_on(on, v, pull, left, min_turning_piece * time);
        const double s = slide.duration;
        const Vec3d v1 = v + s * slide.a;
        v = slide.stops ? Vec3d(Vec3d::Zero()) : Vec3d(v + 0.5 * s * (slide.a + slide_on(on, v1, pull, 0, 0).a));
        left -= s;
    }
    CHECK(pieces < 64);
    CHECK_THAT(v, close_to(Vec3d(excess * time, 0, 0), 2 * speed));
}

TEST_CASE("a surface does not support a point that is pulled off it, or that it falls away from", "[slide]")
{
    CHECK(slide_on(support({0, 1, 0}, 0), {1, 0, 0}, {0, g, 0}, 1, 0).kind == Slide::Leaves);
    Support ball = support({0, 1, 0}, 0);
    ball.curvature = 1;  // a ball of 1 m, which a point leaves at v² > g
    CHECK(slide_on(ball, {std::sqrt(0.99 * g), 0, 0}, {0, -g, 0}, 1, 0).kind == Slide::Moves);
    CHECK(slide_on(ball, {std::sqrt(1.01 * g), 0, 0}, {0, -g, 0}, 1, 0).kind == Slide::Leaves);
}

TEST_CASE("a point in a groove slides along the edge of its sides, with the friction of both", "[slide]")
{
    // Each side of a groove of 90 degrees supports g cos(slope) / √2.
    const double friction = 0.1, slope = 0.3;
    const Support left = support({1, 1, 0}, friction), right = support({-1, 1, 0}, friction);
    int lifted = 0;
    const Vec3d pull(0, -g * std::cos(slope), g * std::sin(slope));
    const Slide slide = slide_along(left, right, Vec3d::Zero(), pull, 1, lifted);
    CHECK(lifted == -1);
    CHECK(slide.kind == Slide::Moves);
    const double along = g * (std::sin(slope) - friction * std::sqrt(2.0) * std::cos(slope));
    CHECK_THAT(slide.a, close_to(Vec3d(0, 0, along), 1e-12));

    CHECK(slide_along(left, right, Vec3d::Zero(), {g, -0.5 * g, 0}, 1, lifted).kind == Slide::Leaves);
    CHECK(lifted == 0);
}

TEST_CASE("parallel transport keeps a tangent tangential, and its length", "[slide]")
{
    const Vec3d n(0, 1, 0), n1 = Vec3d(0.3, 1, -0.2).normalized(), tangent(2, 0, 1);
    const Vec3d there = transported(tangent, n, n1);
    CHECK(there.dot(n1) == Approx(0).margin(1e-15));
    CHECK(there.norm() == Approx(tangent.norm()));
    CHECK_THAT(transported(there, n1, n), close_to(tangent, 1e-14));
}

TEST_CASE("parallel surfaces have no edge", "[slide]")
{
    CHECK(edge_of(support({0, 1, 0}, 0), support({1e-4, 1, 0}, 0)).isZero());
    CHECK_THAT(edge_of(support({0, 1, 0}, 0), support({1, 0, 0}, 0)), close_to(Vec3d(0, 0, -1), 1e-15));
}

}  // namespace
}  // namespace rapid
