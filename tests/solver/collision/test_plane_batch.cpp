#include "runtime/solver/collision/plane_contacts.h"

#include <cmath>

#include "tests/solver/scene.h"
#include "tests/test.h"

namespace rapid {
namespace {

using test::close_to;

using test::g;
const HalfSpace floor_plane{{0, 1, 0}, 0};

void add(PlaneBatch& batch, const Vec3d& P, const Vec3d& v, const Vec3d& a = {0, -g, 0})
{
    batch.add(static_cast<std::uint32_t>(batch.size()), P, v, a, /*dt=*/0.5, {0, /*bounce=*/0.5, /*friction=*/0.25});
}

TEST_CASE("a batch distinguishes points that miss a plane, slide on it and bounce off it once", "[plane]")
{
    PlaneBatch batch;
    add(batch, {0, 10, 0}, {1, 0, 0});             // does not descend in time
    add(batch, {0, 0, 0}, {1, 0, 0});              // lies
    add(batch, {0, 1, 0}, {1, -4, 0});             // falls
    add(batch, {0, 0.001, 0}, {0, 0, 0});          // comes to rest
    add(batch, {0, 0, 0}, {1, 0, 0}, {1, -g, 0});  // another force drives it along the plane
    add(batch, {0, -1, 0}, {0, 0, 0});             // is below
    batch.solve(floor_plane);

    CHECK(batch.outcome(0) == PlaneBatch::Misses);
    CHECK(batch.outcome(1) == PlaneBatch::Slides);
    CHECK(batch.outcome(2) == PlaneBatch::Bounces);
    for (std::size_t j = 3; j < batch.size(); ++j) CHECK(batch.outcome(j) == PlaneBatch::Undecided);
}

TEST_CASE("a batch slides a point to its stop", "[plane]")
{
    PlaneBatch batch;
    add(batch, {0, 0, 0}, {1, 0, 0});  // stops after 1/(μ g) = 0.41 s
    batch.solve(floor_plane);
    CHECK_THAT(batch.end(0), close_to(Vec3d(1 / (2 * 0.25 * g), 0, 0), 1e-15));
    CHECK(batch.velocity(0) == Vec3d(0, 0, 0));
}

TEST_CASE("a batch bounces a point at the time of impact", "[plane]")
{
    PlaneBatch batch;
    add(batch, {0, 1, 0}, {3, -4, 0});
    batch.solve(floor_plane);
    const double speed = std::sqrt(16 + 2 * g), s = (speed - 4) / g, left = 0.5 - s;
    const double along = 3 - 0.25 * 1.5 * speed, up = 0.5 * speed;
    CHECK(batch.left(0) == Approx(left));
    CHECK(batch.approach(0) == Approx(speed));
    CHECK_THAT(batch.contact(0), close_to(Vec3d(3 * s, 0, 0), 1e-14));
    CHECK_THAT(batch.change(0), close_to(Vec3d(along - 3, 1.5 * speed, 0), 1e-14));
    CHECK_THAT(batch.end(0), close_to(Vec3d(3 * s + along * left, up * left - g * left * left / 2, 0), 1e-14));
    CHECK_THAT(batch.velocity(0), close_to(Vec3d(along, up - g * left, 0), 1e-14));
}

TEST_CASE("points that may come near another shape after their contact are left undecided", "[plane]")
{
    PlaneBatch batch;
    add(batch, {0, 0, 0}, {1, 0, 0});   // to x = 0.2
    add(batch, {0, 10, 0}, {1, 0, 0});  // misses, regardless of other shapes
    batch.solve(floor_plane);
    batch.mark_undecided_near({Vec3d(0.5, -1, -1), Vec3d(1, 1, 1)}, 0.25);
    CHECK(batch.outcome(0) == PlaneBatch::Slides);
    batch.mark_undecided_near({Vec3d(0.5, -1, -1), Vec3d(1, 1, 1)}, 0.375);
    CHECK(batch.outcome(0) == PlaneBatch::Undecided);
    CHECK(batch.outcome(1) == PlaneBatch::Misses);
}

}  // namespace
}  // namespace rapid
