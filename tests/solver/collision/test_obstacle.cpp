#include <algorithm>

#include "runtime/shapes/analytic/analytic.h"
#include "runtime/solver/collision/obstacle.h"
#include "tests/test.h"

namespace rapid {
namespace {

using test::points;

// A collider that outlives its obstacles.
struct ShapeCollider : Collider {
    explicit ShapeCollider(ShapePtr of) { shape = std::move(of); }
    Obstacle among(const PointSet& set) const { return {*this, set, radii_of(radius, set)}; }
};

TEST_CASE("the contact tolerance grows with the coordinates that are rounded, and with the radius", "[obstacle]")
{
    const PointSet set = points({{0, 0, 0}});
    const ShapeCollider plane(make_plane({0, 1, 0}, 0));
    const Obstacle obstacle = plane.among(set);
    CHECK(obstacle.contact_tolerance({0, 0, 0}, 0) == 0);
    CHECK(obstacle.contact_tolerance({1, -4, 2}, 0) == 0x1p-20);
    CHECK(obstacle.contact_tolerance({0, 0, 0}, 2) == 0x1p-21);
}

TEST_CASE("the largest radius is that of the queried points", "[obstacle]")
{
    const PointSet set = points({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}).set<float>("pscale", {0.5f, 2, 1});
    const ShapeCollider plane(make_plane({0, 1, 0}, 0));
    const Obstacle obstacle = plane.among(set);
    const std::vector<std::uint32_t> some{0, 2}, all{0, 1, 2};
    CHECK(obstacle.largest_radius(some) == 1);
    CHECK(obstacle.largest_radius(all) == 2);
}

TEST_CASE("marks are kept on points outside all obstacles, in whichever order", "[obstacle]")
{
    const ShapeCollider here(make_sphere_shape(1, {0, 0, 0})), there(make_sphere_shape(1, {5, 0, 0}));
    std::vector<Vec3f> P{{0, 3, 0}, {0, 0.5f, 0}, {5, 0, 0}, {0, 3, 0}};  // the last touches
    std::vector<float> radius{0, 0, 0, 2};
    std::vector<std::uint8_t> expected{1, 0, 0, 0};
    const std::vector<std::uint32_t> all{0, 1, 2, 3};
    for (int turn = 0; turn < 4; ++turn) {
        CAPTURE(turn);
        const PointSet set = points(P).set<float>("pscale", radius);
        const std::vector<Obstacle> obstacles{here.among(set), there.among(set)};
        std::vector<Vec3d> in_double;
        for (const Vec3f& x : P) in_double.push_back(x.cast<double>());
        std::vector<std::uint8_t> marks{1, 1, 1, 1};
        keep_outside(obstacles, all, in_double, marks);
        CHECK(marks == expected);

        std::rotate(P.begin(), P.begin() + 1, P.end());
        std::rotate(radius.begin(), radius.begin() + 1, radius.end());
        std::rotate(expected.begin(), expected.begin() + 1, expected.end());
    }
}

using test::close_to;

TEST_CASE("a bounce reverses the closing speed and scales it by bounce, in the wall's frame", "[response]")
{
    const double bounce = GENERATE(0.0, 0.3, 1.0);
    const double wall = GENERATE(-5.0, 0.0, 5.0);  // m/s along the normal
    CAPTURE(bounce, wall);

    const Vec3d v = contact_response({2, wall - 3, 0}, {0, wall, 0}, Vec3d::UnitY(), bounce, /*friction=*/0);

    CHECK_THAT(v, close_to(Vec3d(2, wall + 3 * bounce, 0), 1e-15 * 8));  // paper eq. (4)
}

TEST_CASE("friction takes at most its part of the normal impulse from the tangent", "[response]")
{
    const double friction = GENERATE(0.0, 0.1, 0.4);
    const double bounce = GENERATE(0.0, 0.5, 1.0);
    CAPTURE(friction, bounce);

    const Vec3d v = contact_response({3, -2, 4}, Vec3d::Zero(), Vec3d::UnitY(), bounce, friction);

    const double speed = 5 - friction * (1 + bounce) * 2;  // along (3, 0, 4) / 5
    CHECK_THAT(v, close_to(Vec3d(0.6 * speed, 2 * bounce, 0.8 * speed), 1e-14));
}

TEST_CASE("friction never reverses the tangent", "[response]")
{
    const Vec3d v = contact_response({1, -2, 0}, Vec3d::Zero(), Vec3d::UnitY(), 0.5, /*friction=*/10);
    CHECK(v == Vec3d(0, 1, 0));
}

TEST_CASE("friction drags a point along with a moving surface", "[response]")
{
    const Vec3d v = contact_response({0, -1, 0}, {3, 0, 0}, Vec3d::UnitY(), 0, /*friction=*/100);
    CHECK(v == Vec3d(3, 0, 0));
}

TEST_CASE("a separating pair, and one at rest, is left alone", "[response]")
{
    CHECK(contact_response({1, 2, 3}, Vec3d::Zero(), Vec3d::UnitY(), 0.5, 1) == Vec3d(1, 2, 3));
    CHECK(contact_response({1, 0, 3}, Vec3d::Zero(), Vec3d::UnitY(), 0.5, 1) == Vec3d(1, 0, 3));
}

TEST_CASE("the energy of a contact with a wall at rest never grows", "[response]")
{
    rc::prop("", [] {
        const auto number = [](int lo, int hi) { return *rc::gen::inRange(lo, hi) * 1e-3; };
        const Vec3d v(number(-9000, 9000), number(-9000, 9000), number(-9000, 9000));
        const Vec3d n = Vec3d(number(-900, 900), number(-900, 900), 1 + number(0, 900)).normalized();
        const Vec3d after = contact_response(v, Vec3d::Zero(), n, number(0, 1001), number(0, 3000));
        RC_ASSERT(after.norm() <= v.norm() * (1 + 1e-15));
    });
}

}  // namespace

}  // namespace rapid
