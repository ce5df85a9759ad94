// Collision against closed forms: bouncing, sliding, resting; many contacts and many shapes; extremes.
#include "runtime/solver/collision/collisions.h"

#include <atomic>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/solver/collision/hollow.h"
#include "tests/solver/scene.h"

namespace rapid {
namespace {

using test::close_to;
using test::HollowBall;
using test::NarrowBall;
using test::points;
using test::Scene;

using test::g;
using test::h;
constexpr double degrees = std::numbers::pi / 180;

// A ball dropped from rest, bouncing with ε on a floor, with height 0 at contact.
struct BouncingBall {
    double from, bounce;

    double fall_time() const { return std::sqrt(2 * from / g); }
    double impact_speed() const { return std::sqrt(2 * g * from); }
    double rest_time() const { return fall_time() * (1 + bounce) / (1 - bounce); }

    double height(double t) const
    {
        if (t < fall_time()) return from - g * t * t / 2;
        if (t >= rest_time()) return 0;
        t -= fall_time();
        double speed = bounce * impact_speed();
        for (; t >= 2 * speed / g; speed *= bounce) t -= 2 * speed / g;
        return speed * t - g * t * t / 2;
    }
};

TEST_CASE("a bouncing ball is on its parabolas, at one sub-step as at many", "[collide]")
{
    const int substeps = GENERATE(1, 2, 7, 64);
    const float bounce = GENERATE(0.0f, 0.3f, 0.7f, 0.9f);
    const double radius = GENERATE(0.0, 0.125);
    CAPTURE(substeps, bounce, radius);
    const BouncingBall ball{2, bounce};
    Scene scene(points({{0, float(2 + radius), 0}}).set<float>("pscale", {float(radius)}));
    scene.gravity().floor(bounce).substeps(substeps);

    for (int f = 1; f <= 96; ++f) {
        scene.run(1);
        // The state's rounding, and its effect on the time of an impact at up to 6.3 m/s.
        CHECK_THAT(scene.P(), close_to(Vec3d(0, radius + ball.height(f * h), 0), f * 1e-6));
    }
    CHECK(scene.penetration_max == 0);
}

// A second plane that nothing touches reaches everywhere, so points on the floor are not near a single shape.
TEST_CASE("points fall, bounce, slide and rest on a floor alike with and without another shape nearby", "[collide]")
{
    std::mt19937 random(11);
    std::uniform_real_distribution<float> place(-2, 2), speed(-4, 4);
    std::vector<Vec3f> P, v;
    for (int i = 0; i < 2000; ++i) {
        P.emplace_back(place(random), i % 3 == 0 ? 0.0f : std::abs(place(random)), place(random));
        v.emplace_back(speed(random), i % 3 == 0 ? 0.0f : speed(random), speed(random));
    }
    const Vec3d pull = GENERATE(Vec3d(0, -9.81, 0), Vec3d(3, -9.81, 1));
    const float friction = GENERATE(0.0f, 0.3f, 2.0f);
    const float radius = GENERATE(0.0f, 0.0625f);
    CAPTURE(pull.transpose(), friction, radius);
    PointSet set = points(P).set<float>("pscale", std::vector<float>(P.size(), radius));
    std::copy(v.begin(), v.end(), set.v().write().begin());
    for (Vec3f& at : set.P().write()) at.y() += radius;
    Scene without(std::move(set));
    without.gravity(pull).floor(0.3f, friction);
    Scene with = without;
    with.collide(make_plane(Vec3d(1, 3, 0), -1e4));
    for (int f = 0; f < 48; ++f) {
        with.points = without.points;  // a rounding error grows with every bounce
        with.run(1);
        without.run(1);
        for (std::size_t i = 0; i < P.size(); ++i) {
            REQUIRE_THAT(with.P(i), close_to(without.P(i), 2e-6));
            REQUIRE_THAT(with.v(i), close_to(without.v(i), 2e-5));
        }
        CHECK(with.last.collisions == without.last.collisions);
    }
    CHECK(without.penetration_max == 0);
}

TEST_CASE("each bounce of a ball scales its energy by bounce squared", "[collide]")
{
    const float bounce = 0.8f;
    const double from = 3, radius = 0.25;
    Scene scene(points({{0, float(from), 0}}).set<float>("pscale", {float(radius)}));
    scene.gravity().floor(bounce);
    for (int f = 1; f <= 96; ++f) {
        scene.run(1);
        const double top = scene.P().y() + scene.v().squaredNorm() / (2 * g);
        CHECK(top == Approx((from - radius) * std::pow(double(bounce), 2.0 * scene.collisions) + radius).margin(1e-5));
    }
    CHECK(scene.collisions >= 3);
}

TEST_CASE("a bouncing ball comes to rest in the frame that the closed form says, and stays", "[collide]")
{
    const int substeps = GENERATE(1, 5, 16);
    const float bounce = GENERATE(0.2f, 0.5f, 0.7f);
    CAPTURE(substeps, bounce);
    const BouncingBall ball{1, bounce};
    Scene scene(points({{0.25f, 1, -3}}));
    scene.gravity().floor(bounce).substeps(substeps);

    for (int f = 1; f <= 60; ++f) {
        scene.run(1);
        CAPTURE(f);
        const bool rests = scene.v() == Vec3d(0, 0, 0) && scene.P() == Vec3d(0.25, 0, -3);
        CHECK(rests == (f * h > ball.rest_time()));
    }
}

TEST_CASE("a ball of bounce 1 never rests, and keeps its height", "[collide]")
{
    Scene scene(points({{0, 1, 0}}));
    scene.gravity().floor(1).run(2400);  // 100 s, 111 bounces
    const double top = scene.P().y() + scene.v().squaredNorm() / (2 * g);
    // 2,400 roundings of v, each of at most 0.5 ulp(4) = 2.4e-7 at up to 4.4 m/s, half of them up.
    CHECK(top == Approx(1).margin(1e-4));
    CHECK(scene.collisions == 111);
}

TEST_CASE("a point rests on a plane for a thousand frames without moving by a bit", "[collide]")
{
    const Vec3d normal = GENERATE(Vec3d(0, 1, 0), Vec3d(0.3, 1, -0.2), Vec3d(1, 1, 1));
    const double offset = GENERATE(0.0, 0.7, -3.3);
    const float radius = GENERATE(0.0f, 0.1f);
    CAPTURE(normal, offset, radius);
    const Vec3d n = normal.normalized();
    std::vector<Vec3f> P;
    for (const double aside : {0.0, -20.0, 1000.0})
        P.push_back((n * (offset / normal.norm() + radius + 1) + aside * n.cross(Vec3d(1, 0, 0))).cast<float>());
    Scene scene(points(P).set<float>("pscale", {radius, radius, radius}));
    scene.gravity().collide(make_plane(normal, offset), 0.3f, /*friction=*/3.0f).run(200);
    for (std::size_t i = 0; i < 3; ++i) P[i] = scene.P(i).cast<float>();
    scene.penetration_max = 0;
    scene.run(1000);

    for (std::size_t i = 0; i < 3; ++i) {
        CAPTURE(i);
        CHECK(scene.P(i) == P[i].cast<double>());
        CHECK(scene.v(i) == Vec3d(0, 0, 0));
        const double gap = n.dot(scene.P(i)) - offset / normal.norm() - radius;
        CHECK(gap >= -1e-15 * scene.P(i).norm());  // never below the surface, within double precision
        CHECK(gap <= 0x1p-23 * scene.P(i).cwiseAbs().maxCoeff());
    }
    CHECK(scene.penetration_max <= 1e-12);
}

TEST_CASE("a point on a slope rests where friction is above the tangent of its angle", "[collide]")
{
    const double angle = GENERATE(5.0, 30.0, 60.0) * degrees;
    const double part = GENERATE(0.0, 0.5, 0.99, 1.01, 2.0);
    const int substeps = GENERATE(1, 8);
    CAPTURE(angle, part, substeps);
    const float friction = float(part * std::tan(angle));
    Scene scene(points({{0, 0, 0}}));
    scene.gravity().collide(make_plane({std::sin(angle), std::cos(angle), 0}, 0), 0.5f, friction).substeps(substeps);
    scene.run(24);

    const double a = std::max(0.0, g * (std::sin(angle) - friction * std::cos(angle)));  // m/s², for 1 s
    const Vec3d down(std::cos(angle), -std::sin(angle), 0);
    CHECK_THAT(scene.P(), close_to(Vec3d(a / 2 * down), 24 * 1e-6));
    CHECK_THAT(scene.v(), close_to(Vec3d(a * down), 24 * 1e-6));
    if (part > 1) CHECK(scene.P() == Vec3d(0, 0, 0));
}

TEST_CASE("a sliding point stops after v²/(2 μ g)", "[collide]")
{
    const float friction = GENERATE(0.1f, 0.35f, 0.9f);
    const int substeps = GENERATE(1, 16);
    CAPTURE(friction, substeps);
    Scene scene(points({{0, 0, 0}}).v({{1.5f, 0, 2}}));  // 2.5 m/s
    scene.gravity().floor(0.5f, friction).substeps(substeps).run(72);

    const double way = 2.5 * 2.5 / (2 * friction * g);
    CHECK_THAT(scene.P(), close_to(Vec3d(way * Vec3d(0.6, 0, 0.8)), 1e-5));
    CHECK(scene.v() == Vec3d(0, 0, 0));
}

TEST_CASE("an oblique impact loses μ (1 + ε) |vn| of its tangential speed", "[collide]")
{
    Scene scene(points({{0, 0.01f, 0}}).v({{3, -4, 0}}));
    scene.floor(0.5f, 0.25f).run(1);
    CHECK_THAT(scene.v(), close_to(Vec3d(3 - 0.25 * 1.5 * 4, 2, 0), 1e-6));
}

TEST_CASE("the bounces that a rest skips would have lost as much by friction", "[collide]")
{
    // Dropped with a tangential speed: once with a frame long enough to come to rest, once with frames of one bounce
    // each.
    const float bounce = 0.5f, friction = 0.05f;
    Scene coarse(points({{0, 0.05f, 0}}).v({{2, 0, 0}})), fine(coarse);
    coarse.gravity().floor(bounce, friction).frame_length(0.5).run(1);
    fine.gravity().floor(bounce, friction).frame_length(0.5 / 4096).run(4096);
    CHECK(coarse.v().x() == Approx(fine.v().x()).margin(4096 * 1.2e-7));
    CHECK(coarse.v().y() == 0);
}

TEST_CASE("friction across a slope turns the path downhill", "[collide]")
{
    // The hodograph of a point sliding on a slope with μ = tan θ: v + v·downhill is constant, so v tends to half of it.
    const double angle = 30 * degrees;
    const float friction = float(std::tan(angle));
    Scene scene(points({{0, 0, 0}}).v({{0, 0, 2}}));
    scene.gravity().collide(make_plane({std::sin(angle), std::cos(angle), 0}, 0), 0.0f, friction).run(96);

    const Vec3d down(std::cos(angle), -std::sin(angle), 0);
    CHECK(scene.v().norm() + scene.v().dot(down) == Approx(2).epsilon(2e-3));
    CHECK(scene.v().dot(down) == Approx(1).epsilon(2e-3));
}

TEST_CASE("a point in a groove of two planes comes to rest, and stays for a thousand frames", "[collide]")
{
    const double left = GENERATE(30.0, 45.0, 80.0) * degrees, right = GENERATE(20.0, 45.0, 60.0) * degrees;
    const float bounce = GENERATE(0.0f, 0.5f), friction = GENERATE(0.0f, 0.3f);
    CAPTURE(left / degrees, right / degrees, bounce, friction);
    Scene scene(points({{0.1f, 1, 0}, {0, 0, 0}, {-0.3f, 2, 1}}));
    scene.gravity()
        .collide(make_plane({std::sin(left), std::cos(left), 0}, 0), bounce, friction)
        .collide(make_plane({-std::sin(right), std::cos(right), 0}, 0), bounce, friction)
        .run(480);
    std::vector<Vec3d> P;
    for (std::size_t i = 0; i < 3; ++i) P.push_back(scene.P(i));
    scene.run(1000);

    for (std::size_t i = 0; i < 3; ++i) {
        CAPTURE(i);
        CHECK(scene.P(i) == P[i]);
        CHECK(scene.v(i).norm() < 1e-12);
        if (friction == 0) CHECK_THAT(scene.P(i), close_to(Vec3d(0, 0, i == 2 ? 1 : 0), 1e-6));
    }
    CHECK(scene.penetration_max < 1e-6);
}

TEST_CASE("a point in a corner of three planes rests there", "[collide]")
{
    Scene scene(points({{1, 2, 1}}).v({{-1, 0, -2}}));
    const float bounce = GENERATE(0.0f, 0.6f);
    scene.gravity({-1, -9.81, -1})
        .collide(make_plane({1, 0, 0}, 0), bounce)
        .collide(make_plane({0, 1, 0}, 0), bounce)
        .collide(make_plane({0, 0, 1}, 0), bounce)
        .run(480);
    CHECK(scene.P() == Vec3d(0, 0, 0));
    CHECK(scene.v() == Vec3d(0, 0, 0));
}

// A plane that counts the paths for which it is queried.
class QueriedPlane final : public Shape {
public:
    QueriedPlane(const Vec3d& normal, double offset) : plane_(make_plane(normal, offset)) {}

    mutable std::atomic<std::size_t> queries = 0;

    Box3d bounds() const override { return plane_->bounds(); }
    void distance(std::span<const Vec3d> P, std::span<double> phi, std::span<Vec3d> gradient) const override
    {
        plane_->distance(P, phi, gradient);
    }
    void first_contact(std::span<const Path> paths, std::span<Contact> contacts) const override
    {
        queries += paths.size();
        plane_->first_contact(paths, contacts);
    }

private:
    ShapePtr plane_;
};

TEST_CASE("a point at the foot of a wall that it nears by rounding alone slides along it to a stop", "[collide]")
{
    const double overhang = GENERATE(0.0, 1e-10, 1e-9, 1e-8, -1e-8);  // radians
    const float approach = GENERATE(0.0f, 1e-17f, 1e-14f, 1e-12f, 1e-10f), speed = GENERATE(0.0f, 0.01f, 1.0f);  // m/s
    const int substeps = GENERATE(1, 8);
    CAPTURE(overhang, approach, speed, substeps);
    constexpr float friction = 0.25f, r = 0.0625f;
    Scene scene(points({{0, r, r}}).v({{speed, 0, -approach}}).set<float>("pscale", {r}));
    const auto floor = std::make_shared<QueriedPlane>(Vec3d(0, 1, 0), 0.0);
    const auto wall = std::make_shared<QueriedPlane>(Vec3d(0, -overhang, 1), 0.0);
    scene.gravity().collide(floor, 0, friction).collide(wall, 0, friction).substeps(substeps).run(24);

    CHECK_THAT(scene.P(), close_to(Vec3d(speed * speed / (2 * friction * g), r, r), 1e-6));
    CHECK(scene.P().y() == double(r));
    CHECK(scene.v() == Vec3d(0, 0, 0));
    CHECK(scene.penetration_max < 1e-8);
    // One or two paths per substep, instead of alternating between floor and wall at each moment.
    CHECK(floor->queries + wall->queries < 4u * 24u * static_cast<unsigned>(substeps));
}

TEST_CASE("a point slides along a wall at the speed that it has along it", "[collide]")
{
    const float friction = GENERATE(0.0f, 0.1f);
    Scene scene(points({{0, 0, 0}}).v({{-1, 0, 2}}));
    scene.gravity().floor(0, friction).collide(make_plane({1, 0, 0}, -0.25), 0.0f, 0.0f).run(24);

    CHECK(scene.P().x() == -0.25);
    CHECK(scene.P().y() == 0);
    CHECK(scene.v().x() == 0);
    if (friction == 0) {
        CHECK_THAT(scene.P(), close_to(Vec3d(-0.25, 0, 2), 1e-5));
        CHECK_THAT(scene.v(), close_to(Vec3d(0, 0, 2), 1e-6));
    }
}

TEST_CASE("of several shapes the first along the path is met, in any order of the chain", "[collide]")
{
    const bool swapped = GENERATE(false, true);
    Scene scene(points({{0, 0, 0}}).v({{100, 0, 0}}));
    const ShapePtr near = make_sphere_shape(1, {3, 0, 0}), far = make_plane({-1, 0, 0}, -3.5);
    scene.collide(swapped ? far : near, swapped ? 0.5f : 1.0f).collide(swapped ? near : far, swapped ? 1.0f : 0.5f);
    scene.run(1);
    CHECK_THAT(scene.v(), close_to(Vec3d(-100, 0, 0), 1e-5));
    CHECK_THAT(scene.P(), close_to(Vec3d(2 - (100 * h - 2), 0, 0), 1e-6));
}

TEST_CASE("a point between two walls makes all its bounces in one step", "[collide]")
{
    // 4.1666 m in a slit of 1 mm: 4,166 bounces.
    Scene scene(points({{0.0005f, 0, 0}}).v({{100, 0, 0}}));
    scene.collide(make_plane({1, 0, 0}, 0), 1.0f).collide(make_plane({-1, 0, 0}, -0.001), 1.0f).run(1);
    CHECK(scene.last.collisions == 4167);
    CHECK(std::abs(scene.v().x()) == 100);
    CHECK(scene.last.contact_limit == 0);
    CHECK(scene.last.penetration_max < 1e-9);
}

TEST_CASE("at the limit of contacts a point rests at its last one, and is counted", "[collide][extreme]")
{
    Scene scene(points({{5e-7f, 0, 0}, {0.5f, 0, 0}}).v({{100, 0, 0}, {1, 0, 0}}));
    scene.collide(make_plane({1, 0, 0}, 0), 1.0f, 0.0f).collide(make_plane({-1, 0, 0}, -1e-6), 1.0f, 0.0f, "slit");
    scene.points.group("slit").write()[0] = 1;
    scene.run(1);
    CHECK(scene.last.contact_limit == 1);
    CHECK(scene.v().x() == 0);
    CHECK(scene.P().x() >= 0);
    CHECK(scene.P().x() <= 1e-6 * (1 + 1e-6));
    CHECK_THAT(scene.P(1), close_to(Vec3d(0.5 + h, 0, 0), 1e-7));
}

TEST_CASE("a collider acts on its group alone, with each point's own bounce and friction", "[collide]")
{
    Scene scene(points({{0, 0.1f, 0}, {0, 0.1f, 0}, {0, 0.1f, 0}})
                    .v({{2, -10, 0}, {2, -10, 0}, {2, -10, 0}})
                    .set<float>("bounciness", {1, 0.5f, 0.25f})
                    .set<float>("grip", {0, 0.1f, 0.1f})
                    .group("solid", {0, 1}));
    scene.collide(make_plane({0, 1, 0}, 0), PerPoint<float>::of("bounciness"), PerPoint<float>::of("grip"), "solid");
    scene.run(1);
    CHECK_THAT(scene.v(0), close_to(Vec3d(2, 10, 0), 1e-6));
    CHECK_THAT(scene.v(1), close_to(Vec3d(2 - 0.1 * 1.5 * 10, 5, 0), 1e-6));
    CHECK(scene.v(2) == Vec3d(2, -10, 0));
}

TEST_CASE("a collider's radius is pscale unless it is given", "[collide]")
{
    Scene scene(points({{0, 1, 0}, {5, 1, 0}}).set<float>("pscale", {0.25f, 0}).set<float>("size", {0.125f, 0.5f}));
    scene.gravity().floor(0);
    const bool given = GENERATE(false, true);
    if (given) {
        auto collider = std::make_shared<Collider>(*scene.dynamics.colliders().back());
        collider->radius = PerPoint<float>::of("size");
        scene.dynamics.replace_collider(0, collider);
    }
    scene.run(48);
    CHECK(scene.P(0).y() == (given ? 0.125 : 0.25));
    CHECK(scene.P(1).y() == (given ? 0.5 : 0));
}

TEST_CASE("a ball in a hollow ball keeps its speed and angle for 10,000 bounces", "[collide]")
{
    // A chord between points 90 degrees apart, at 45 degrees to the normal at both its ends.
    const double radius = 1, chord = std::sqrt(2.0), speed = 10;
    Scene scene(points({{1 - 1e-7f, 0, 0}}).v({Vec3f(-1, 1, 0).normalized() * float(speed)}));
    scene.collide(std::make_shared<HollowBall>(radius), 1.0f).frame_length(10).substeps(1);
    const int frames = 142;
    scene.run(frames);

    CHECK(double(scene.collisions) == Approx(frames * 10 * speed / chord).margin(2));
    CHECK(scene.collisions > 10000);
    CHECK(scene.v().norm() == Approx(speed).epsilon(frames * 6e-8));  // v is rounded once per frame
    const double from_center = (scene.P() - scene.P().dot(scene.v()) / scene.v().squaredNorm() * scene.v()).norm();
    CHECK(from_center == Approx(std::sqrt(0.5)).epsilon(frames * 2e-7));
    CHECK(scene.P().norm() <= radius);
}

TEST_CASE("a point slides off a ball at 2/3 of the height that it started from", "[collide]")
{
    const double R = GENERATE(0.5, 1.0);
    const int substeps = GENERATE(1, 4);
    CAPTURE(R, substeps);
    const double from = 10 * degrees;
    Scene scene(points({Vec3f(float(std::sin(from) * R), float(std::cos(from) * R), 0)}));
    scene.gravity().collide(make_sphere_shape(R, {0, 0, 0}), 0.0f).substeps(substeps);

    for (int f = 0; f < 48; ++f) {
        scene.run(1);
        REQUIRE(scene.P().norm() >= R * (1 - 1e-7));
        // Frictionless: the energy follows from the height, on the ball and off it.
        CHECK(scene.v().squaredNorm() / 2 == Approx(g * (R * std::cos(from) - scene.P().y())).epsilon(2e-3));
    }
    const double cosine = 2.0 / 3 * std::cos(from);
    const double speed = std::sqrt(2 * g * R * (std::cos(from) - cosine));
    CHECK(scene.v().x() == Approx(speed * cosine).epsilon(2e-3));  // unchanged since it left
}

TEST_CASE("a point on a curved floor swings as a pendulum, on the surface", "[collide]")
{
    const double R = 1, amplitude = 20 * degrees;
    Scene scene(points({Vec3f(float(std::sin(amplitude) * R), float(-std::cos(amplitude) * R), 0)}));
    scene.gravity().collide(std::make_shared<HollowBall>(R), 0.0f);

    // T = 2π √(R/g) (1 + θ²/16 + 11 θ⁴/3072), to 1e-5 at 20 degrees
    const double period =
        2 * std::numbers::pi * std::sqrt(R / g) * (1 + amplitude * amplitude / 16 + 11 * std::pow(amplitude, 4) / 3072);
    const int turns = 10, frames_per_turn = 48;
    scene.frame_length(period / frames_per_turn);
    for (int f = 1; f <= turns * frames_per_turn; ++f) {
        scene.run(1);
        REQUIRE(scene.P().norm() == Approx(R).epsilon(1e-6));
        if (f % frames_per_turn == 0) {
            CAPTURE(f);
            CHECK_THAT(scene.P(), close_to(Vec3d(std::sin(amplitude), -std::cos(amplitude), 0), 0.01));
        }
    }
    CHECK(scene.collisions == 0);
}

TEST_CASE("a point swings up to the side of a hollow ball, pressed to it by twice its weight", "[collide]")
{
    const double R = 1, energy = g * R * (1 - std::cos(85 * degrees));
    Scene scene(points({{0, float(-R), 0}}).v({{float(std::sqrt(2 * energy)), 0, 0}}));
    scene.gravity().collide(std::make_shared<HollowBall>(R), 0.0f).substeps(GENERATE(1, 4));
    for (int f = 0; f < 96; ++f) {
        scene.run(1);
        REQUIRE(scene.P().norm() == Approx(R).epsilon(1e-6));
        // A substep may begin off the surface by rounding, and meet it at an angle proportional to the square root of
        // that.
        CHECK(scene.v().squaredNorm() / 2 + g * (R + scene.P().y()) == Approx(energy).epsilon(5e-4));
    }
}

TEST_CASE("a point on the top of a ball rests there with friction", "[collide]")
{
    Scene scene(points({{0.1f, 1.5f, 0}}));
    scene.gravity().collide(make_sphere_shape(1, {0, 0, 0}), 0.2f, 0.5f).run(240);
    const Vec3d P = scene.P();
    CHECK(scene.v() == Vec3d(0, 0, 0));
    CHECK(P.norm() == Approx(1).epsilon(1e-6));
    CHECK(P.norm() >= 1 - 1e-9);
    scene.run(1000);
    CHECK(scene.P() == P);
}

TEST_CASE("a point slides over the edge of a table and falls", "[collide]")
{
    Scene scene(points({{0, 0.5f, 0}}).v({{1, 0, 0}}));
    scene.gravity().collide(make_box_shape({1, 1, 1}, {0, 0, 0}), 0.0f).run(24);
    // Half a metre on the table, then free for 0.5 s.
    CHECK_THAT(scene.P(), close_to(Vec3d(1, 0.5 - g * 0.25 / 2, 0), 2e-3));
    CHECK(scene.penetration_max < 1e-6);
}

TEST_CASE("a point that is born in a shape leaves it by the shortest way, without gaining speed", "[collide]")
{
    const double depth = GENERATE(1e-5, 0.01, 0.4);
    const float speed = GENERATE(-3.0f, 0.0f, 3.0f);
    CAPTURE(depth, speed);
    Scene scene(points({{0, float(-depth), 0}, {0, float(1 - depth), 5}}).v({{0, speed, 0}, {0, speed, 0}}));
    scene.collide(make_plane({0, 1, 0}, 0), 0.5f, 0.0f).collide(make_box_shape({2, 2, 2}, {0, 0, 5}), 0.5f, 0.0f);
    scene.run(1);

    const double after = std::abs(speed) * (speed < 0 ? 0.5 : 1);
    CHECK_THAT(scene.v(0), close_to(Vec3d(0, after, 0), 1e-6));
    CHECK_THAT(scene.P(0), close_to(Vec3d(0, after * h, 0), 1e-6));
    CHECK_THAT(scene.P(1), close_to(Vec3d(0, 1 + after * h, 5), 1e-6));
    CHECK(scene.penetration_max < 1e-6);
    CHECK(scene.last.trapped == 0);
}

TEST_CASE("deep inside, without a gradient, a point returns along its path", "[collide]")
{
    Scene scene(points({{0, 0.25f, 0}, {0, 0.25f, 0}}).v({{0, 0, -2}, {0, 0, 0}}));
    scene.gravity({0, 0, 1}).collide(std::make_shared<NarrowBall>(1, 0.1), 0.0f).run(1);
    CHECK(scene.P(0).norm() >= 1 - 1e-6);
    CHECK(scene.P(0).z() > 0.9);
    CHECK(scene.P(1).norm() >= 1 - 1e-6);  // without a velocity, against the acceleration on it
    CHECK(scene.P(1).z() < -0.9);
    CHECK(scene.last.trapped == 0);
}

TEST_CASE("a point at the centre of a ball finds its way out", "[collide][extreme]")
{
    const Vec3f v = GENERATE(Vec3f(0, 0, 0), Vec3f(3, 0, 0));
    Scene scene(points({{1, 2, 3}}).v({v}));
    scene.gravity().collide(make_sphere_shape(0.5, {1, 2, 3}), 0.5f).run(1);
    CHECK((scene.P() - Vec3d(1, 2, 3)).norm() >= 0.5 - 1e-6);
    CHECK(scene.last.trapped == 0);
}

TEST_CASE("a point in two shapes that block each other's way out is counted, and does not hang", "[collide][extreme]")
{
    Scene scene(points({{0, 0, 0}}).v({{0, -1, 0}}));
    scene.gravity().collide(make_plane({0, 1, 0}, 1), 0.5f).collide(make_plane({0, -1, 0}, 1), 0.5f).run(1);
    CHECK(scene.last.trapped == 1);
    CHECK(scene.last.penetration_max >= 1);
    CHECK(scene.v().allFinite());
}

TEST_CASE("no sub-step is too short or too long, no speed too high, no scene too small or large", "[collide][extreme]")
{
    const double length = GENERATE(1e-9, 1e-3, 10.0);
    const double size = GENERATE(1e-3, 1.0, 1e5);
    const float bounce = GENERATE(0.0f, 0.5f, 1.0f), friction = GENERATE(0.0f, 1.0f);
    CAPTURE(length, size, bounce, friction);
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::vector<Vec3f> P, v;
    for (int i = 0; i < 60; ++i) {
        const Vec3d place = size * Vec3d(normal(random), 1.5 + normal(random), normal(random));
        P.push_back(place.cast<float>());
        const double speed = std::pow(10.0, i % 7 * 2 - 6);  // 1e-6 to 1e6 m/s
        v.push_back((speed * Vec3d(normal(random), normal(random), normal(random))).cast<float>());
    }
    P.insert(P.end(), {{0, 0, 0}, {0, float(size), 0}, {float(size), 0, 0}, {0, float(0.5 * size), 0}});
    v.insert(v.end(), 4, Vec3f::Zero());
    Scene scene(points(P).v(v));
    scene.gravity()
        .floor(bounce, friction)
        .collide(make_sphere_shape(size / 2, {0, size / 2, 0}), bounce, friction)
        .collide(make_box_shape({size, size, size}, {size, size / 2, 0}), bounce, friction)
        .frame_length(length);
    scene.run(3);

    for (std::size_t i = 0; i < P.size(); ++i) {
        REQUIRE(scene.P(i).allFinite());
        REQUIRE(scene.v(i).allFinite());
    }
    // Single precision resolves a position of up to x to x 2^-24; friction and bounces add no energy.
    double largest = size;
    for (std::size_t i = 0; i < P.size(); ++i) largest = std::max(largest, scene.P(i).cwiseAbs().maxCoeff());
    CHECK(scene.penetration_max <= 4 * 0x1p-24 * largest);
    CHECK(scene.last.trapped == 0);
}

TEST_CASE("no collision gives a point energy", "[collide]")
{
    std::mt19937 random(9);
    std::uniform_real_distribution<float> place(-1, 1), speed(-8, 8);
    std::vector<Vec3f> P, v;
    for (int i = 0; i < 500; ++i) {
        P.emplace_back(2 * place(random), 3 + place(random), 2 * place(random));
        v.emplace_back(speed(random), speed(random), speed(random));
    }
    const float bounce = GENERATE(0.0f, 0.6f, 1.0f), friction = GENERATE(0.0f, 0.4f);
    CAPTURE(bounce, friction);
    Scene scene(points(P).v(v));
    scene.gravity()
        .collide(make_plane({0.2, 1, 0.1}, 0), bounce, friction)
        .collide(make_sphere_shape(1, {0, 1, 0}), bounce, friction)
        .collide(make_box_shape({1, 2, 1}, {2, 0.5, 0}), bounce, friction);
    for (int f = 0; f < 72; ++f) {
        std::vector<double> before;
        for (std::size_t i = 0; i < P.size(); ++i) before.push_back(scene.v(i).squaredNorm() / 2 + g * scene.P(i).y());
        scene.run(1);
        for (std::size_t i = 0; i < P.size(); ++i) {
            const double after = scene.v(i).squaredNorm() / 2 + g * scene.P(i).y();
            CAPTURE(f, i);
            // Rounding, and on curved surfaces the second-order error of the slide.
            REQUIRE(after <= before[i] + 1e-5 * (1 + std::abs(before[i])) + 1e-3 * scene.v(i).squaredNorm());
        }
    }
    CHECK(scene.penetration_max < 4e-6);
    CHECK(scene.last.trapped == 0);
}

}  // namespace
}  // namespace rapid
