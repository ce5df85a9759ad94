#include "runtime/shapes/motion/moving.h"

#include <cmath>
#include <numbers>
#include <random>

#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/level_set/level_set.h"
#include "tests/test.h"

using namespace rapid;
using rapid::test::close_to;

namespace {

using std::numbers::pi;
const FrameClock clock_1{1, 0};  // one frame per second

MotionPtr along(const Vec3d& way) { return keyed_motion({{0, {}}, {1, {way}}}); }

// Returns a rotation about the z axis by this angle, below half a turn, in one second.
MotionPtr spinning(double angle)
{
    return keyed_motion({{0, {}}, {1, {{0, 0, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vec3d::UnitZ()))}}});
}

ShapePtr moving_in_a_second(const ShapePtr& rest, const MotionPtr& motion)
{
    return moving(rest, *motion, clock_1, 0, 1);
}

Contact contact_of(const ShapePtr& shape, const Path& path)
{
    Contact contact;
    shape->first_contact({&path, 1}, {&contact, 1});
    return contact;
}

// Returns the first time in [0, duration] at which f falls to 0: samples f densely for the first change of sign, then
// bisects.
template <class F>
double first_root(const F& f, double duration)
{
    const int teeth = 200000;
    for (int i = 1; i <= teeth; ++i) {
        double before = duration * (i - 1) / teeth, after = duration * i / teeth;
        if (f(after) > 0) continue;
        for (int k = 0; k < 100; ++k) (f((before + after) / 2) > 0 ? before : after) = (before + after) / 2;
        return before;
    }
    return Contact::none;
}

Vec3d at(const Path& path, double s) { return path.P + s * path.v + 0.5 * s * s * path.a; }

}  // namespace

TEST_CASE("a wall that moves at 100 m/s meets a falling point when their formulas say so", "[moving]")
{
    const double speed = GENERATE(100.0, -3.0, 0.0);
    const ShapePtr floor = moving_in_a_second(make_plane({0, 1, 0}, 0), along({5, speed, 0}));
    const double r = 0.1;
    const Path path{{1, 20, 2}, {0, -1, 0}, {0, -9.81, 0}, 1, r};
    // Solves 20 - s - 9.81 s²/2 = speed s + r.
    const double b = 1 + speed, c = 20 - r, a = 9.81 / 2;
    const double s = 2 * c / (b + std::sqrt(b * b + 4 * a * c));
    const Contact contact = contact_of(floor, path);
    if (s > 1) {
        CHECK(contact.time == Contact::none);
        return;
    }
    CHECK(contact.time == Approx(s).epsilon(1e-12));
    CHECK_THAT(contact.n, close_to(Vec3d(0, 1, 0), 1e-14));
    CHECK_THAT(contact.vc, close_to(Vec3d(5, speed, 0), 1e-12));
}

TEST_CASE("an accelerated ball meets a point at the root of their distance", "[moving]")
{
    // Its centre is at 40 s² along x, so in the ball's frame the point's path is another parabola.
    const MotionPtr accelerated = [] {
        struct Accelerated final : Motion {
            Pose at(const Frame& f) const override { return {{40 * f.time * f.time, 0, 0}}; }
            FrameRange range() const override { return {-INFINITY, INFINITY}; }
        };
        return std::make_shared<Accelerated>();
    }();
    const ShapePtr ball = moving_in_a_second(make_sphere_shape(1, {0, 0, 0}), accelerated);
    const Path path{{20, 0.3, 0}, {-2, 0, 0}, {0, -0.5, 0}, 1, 0.05};
    const double s = first_root([&](double t) { return (at(path, t) - Vec3d(40 * t * t, 0, 0)).norm() - 1.05; }, 1);
    const Contact contact = contact_of(ball, path);
    CHECK(contact.time == Approx(s).margin(1e-10));
    CHECK_THAT(contact.vc, close_to(Vec3d(80 * s, 0, 0), 1e-7));
}

TEST_CASE("a spinning paddle meets a point at the root of its distance, with its rim's velocity", "[moving]")
{
    // The paddle is much thinner than its travel in the interval.
    const double angle = GENERATE(0.7, -3.0, 0.02);
    const Vec3d half(2, 0.05, 1);
    const ShapePtr paddle = moving_in_a_second(make_box_shape(2 * half, {2, 0, 0}), spinning(angle));
    const Path path{{3, angle > 0 ? 1.2 : -1.2, 0.2}, {-0.1, angle > 0 ? -0.3 : 0.3, 0}, {0, 0.2, 0}, 1, 0.01};
    const auto height = [&](double t) {
        const Vec3d X = Eigen::AngleAxisd(-angle * t, Vec3d::UnitZ()) * at(path, t);
        return ((X - Vec3d(2, 0, 0)).cwiseAbs() - half).cwiseMax(0.0).norm() - path.radius;
    };
    const double s = first_root(height, 1);
    const Contact contact = contact_of(paddle, path);
    CAPTURE(angle, s);
    if (s == Contact::none) {
        CHECK(contact.time == Contact::none);
        return;
    }
    CHECK(contact.time == Approx(s).margin(1e-9));
    CHECK_THAT(contact.vc, close_to(Vec3d(angle * Vec3d::UnitZ().cross(at(path, s))), 1e-8));
    const Vec3d up(-std::sin(angle * s), std::cos(angle * s), 0);
    CHECK_THAT(contact.n, close_to(Vec3d(angle > 0 ? up : Vec3d(-up)), 1e-8));
}

TEST_CASE("a spinning, rising and growing ball meets points where its sphere is then", "[moving]")
{
    const Pose end{{0, 4, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(2, Vec3d(1, 1, 0).normalized())), 2.5};
    const ShapePtr ball = moving_in_a_second(make_sphere_shape(0.5, {0.4, 0, 0}), keyed_motion({{0, {}}, {1, end}}));
    const Vec3d axis = Vec3d(1, 1, 0).normalized();
    rc::prop("times to 1e-9 against bisection", [&] {
        const auto coordinate = [](int range) { return *rc::gen::inRange(-100 * range, 100 * range) / 100.0; };
        const Path path{{coordinate(4), 3 + coordinate(4), coordinate(4)},
                        {coordinate(8), coordinate(8), coordinate(8)},
                        {0, -9.81, 0},
                        1,
                        0.02};
        const auto height = [&](double t) {
            const double k = 1 + 1.5 * t;
            const Vec3d center = Vec3d(0, 4 * t, 0) + k * (Eigen::AngleAxisd(2 * t, axis) * Vec3d(0.4, 0, 0));
            return (at(path, t) - center).norm() - 0.5 * k - 0.02;
        };
        if (height(0) < 1e-3) return;
        const double s = first_root(height, 1);
        const double found = contact_of(ball, path).time;
        if (s == Contact::none) {
            // A graze between two samples is invisible to both methods.
            if (found != Contact::none) RC_ASSERT(height(found) < 1e-9);
        } else {
            RC_ASSERT(std::abs(found - s) < 1e-9);
        }
    });
}

TEST_CASE("nothing passes a moving wall, at any speed or turn", "[moving][extreme]")
{
    const double voxel = 0.05;
    const LevelSetPtr plate = level_set_box({3, 2 * voxel, 3}, {0, 0, 0}, {voxel, 3});
    const ShapePtr analytic = make_box_shape({3, 2 * voxel, 3}, {0, 0, 0});
    const double turn = GENERATE(0.0, 1.3), speed = GENERATE(0.0, 100.0, 1e4);
    const Pose end{{0, speed, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(turn, Vec3d::UnitX()))};
    const MotionPtr motion = keyed_motion({{0, {}}, {1, end}});
    std::mt19937 random(1);
    std::uniform_real_distribution<double> in(-1, 1);
    for (const ShapePtr& rest : {ShapePtr(plate), analytic}) {
        const ShapePtr wall = moving_in_a_second(rest, motion);
        int passed = 0;
        double deepest = 0;
        for (int i = 0; i < 500; ++i) {
            // In the plate's own frame the point moves from above the plate to below it.
            const Vec3d from(in(random), 0.3 + 0.2 * in(random), in(random)), to(in(random), -0.3, in(random));
            const Vec3d P = from, Q = end * to;
            const Vec3d a(0, -9.81, 0);
            const Path path{P, Q - P - 0.5 * a, a, 1, 0};
            const Contact contact = contact_of(wall, path);
            passed += contact.time == Contact::none;
            if (contact.time == Contact::none) continue;
            const Vec3d place = at(path, contact.time);
            double phi = 0;
            wall->distance_at({&place, 1}, {&contact.time, 1}, {&phi, 1}, {});
            deepest = std::max(deepest, std::abs(phi));
        }
        CAPTURE(turn, speed, rest->kind());
        CHECK(passed == 0);
        CHECK(deepest < 1e-6);
    }
}

TEST_CASE("a path that leaves a turning body meets it again where it reaches it, even within the same voxel",
          "[moving]")
{
    const MotionPtr turning =
        keyed_motion({{0, {}}, {1, {{0, 0, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Vec3d::UnitY()))}}});
    const ShapePtr body = moving_in_a_second(level_set_torus(0.8, 0.25, {0, 0, 0}, {0.05, 5}), turning);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> in(-1, 1);
    int again = 0;
    for (int i = 0; i < 5000; ++i) {
        const Vec3d to = 4 * Vec3d(in(random), 0, in(random)).normalized();
        const Path inwards{{0, 0, 0}, to - Vec3d(0, 0.3 * in(random), 0), Vec3d::Zero(), 1, 0};
        const Contact first = contact_of(body, inwards);
        REQUIRE(first.time < 0.2);
        const double away = std::pow(10, 1.5 * in(random)-2.5);
        const Vec3d across = first.n.cross(Vec3d::UnitY()).normalized();
        const Path out{
            at(inwards, first.time), first.vc + 4 * across + away * first.n, Vec3d::Zero(), 0.5, 0, first.time};
        const Contact second = contact_of(body, out);
        CAPTURE(i, second.time, away);
        REQUIRE(second.time < out.duration);
        REQUIRE(second.n.dot(out.v - second.vc) < 4e-3);
        again += second.time < 0.0125;
    }
    CHECK(again > 250);
}

TEST_CASE("paths that begin later meet the shape at its pose then", "[moving]")
{
    const ShapePtr ball = moving_in_a_second(make_sphere_shape(1, {0, 0, 0}), along({100, 0, 0}));
    Path path{{55, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0.2, 0};
    path.begin = 0.5;
    CHECK(contact_of(ball, path).time == Approx(0.04));  // the front of the ball is at 51 m at that time
    path.begin = 0.6;
    const Contact within = contact_of(ball, path);  // its centre is at 60 m, so the point is outside again
    CHECK(within.time == Contact::none);
    path.begin = 0.545;
    const Contact inside = contact_of(ball, path);
    CHECK(inside.time == 0);
    CHECK(inside.depth == Approx(0.5));
    CHECK_THAT(inside.vc, close_to(Vec3d(100, 0, 0), 1e-9));
}

TEST_CASE("a point at rest on a moving floor is in contact until the floor moves away", "[moving]")
{
    const Path pressed{{0, 0, 0}, {0, 0, 0}, {0, -9.81, 0}, 1, 0};
    CHECK(contact_of(moving_in_a_second(make_plane({0, 1, 0}, 0), along({0, 2, 0})), pressed).time == 0);
    CHECK(contact_of(moving_in_a_second(make_plane({0, 1, 0}, 0), along({3, 0, 0})), pressed).time == 0);
    // A floor that falls at 2 m/s is reached after 2 v / g.
    CHECK(contact_of(moving_in_a_second(make_plane({0, 1, 0}, 0), along({0, -2, 0})), pressed).time ==
          Approx(4 / 9.81).epsilon(1e-9));

    const Path still{{1, 0, 0}, {0, 0, 0}, {0, 0, 0}, 1, 0};
    CHECK(contact_of(moving_in_a_second(make_plane({0, 1, 0}, 0), spinning(1)), still).time == 0);
    CHECK(contact_of(moving_in_a_second(make_plane({0, 1, 0}, 0), spinning(-1)), still).time == Contact::none);
}

TEST_CASE("a moving shape's distance and velocity are those of each point's own time", "[moving]")
{
    const ShapePtr ball = moving_in_a_second(make_sphere_shape(1, {3, 0, 0}), spinning(pi / 2));
    const std::vector<Vec3d> P{{5, 0, 0}, {0, 5, 0}, {0, 5, 0}};
    const std::vector<double> time{0, 1, 0};
    std::vector<double> phi(3);
    std::vector<Vec3d> gradient(3);
    ball->distance_at(P, time, phi, gradient);
    CHECK(phi[0] == Approx(1));
    CHECK(phi[1] == Approx(1));
    CHECK(phi[2] == Approx(std::sqrt(34.0) - 1));
    CHECK_THAT(gradient[1], close_to(Vec3d(0, 1, 0), 1e-12));
    CHECK_THAT(ball->velocity_at({0, 4, 0}, 0.3), close_to(Vec3d(-2 * pi, 0, 0), 1e-9));
    ball->distance(P, phi, {});
    CHECK(phi[1] == Approx(1));
    CHECK(phi[0] == Approx(std::sqrt(34.0) - 1));
}

TEST_CASE("the bounds of a moving shape contain its whole motion", "[moving]")
{
    const double angle = GENERATE(0.3, 3.0);
    const Pose end{{2, -1, 5}, Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vec3d(1, 2, 3).normalized())), 1.7};
    const MotionPtr motion = keyed_motion({{0, {}}, {1, end}});
    const Box3d bounds = moving_in_a_second(make_box_shape({1, 2, 3}, {4, 0, 0}), motion)->bounds();
    for (int i = 0; i <= 100; ++i)
        for (int k = 0; k < 8; ++k) {
            const Vec3d X = Vec3d(4, 0, 0) + 0.5 * Vec3d(k & 1 ? 1 : -1, k & 2 ? 2 : -2, k & 4 ? 3 : -3);
            CHECK(bounds.contains(motion->at(clock_1.at(i / 100.0)) * X));
        }
}
