#include "runtime/solver/collision/obstacle.h"

#include <algorithm>

#include "runtime/shapes/analytic/analytic.h"
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

}  // namespace
}  // namespace rapid
