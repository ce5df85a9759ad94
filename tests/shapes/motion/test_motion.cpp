#include "runtime/shapes/motion/motion.h"

#include <cmath>
#include <functional>
#include <numbers>

#include "runtime/base/error.h"
#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/placed.h"
#include "tests/test.h"

using namespace rapid;
using rapid::test::close_to;

namespace {

using std::numbers::pi;
const FrameClock clock_24{24, 1};

Eigen::Quaterniond about(const Vec3d& axis, double angle)
{
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

// A motion given by a function of the time, like that of a script.
class Formula final : public Motion {
public:
    explicit Formula(std::function<Pose(double time)> pose) : pose_(std::move(pose)) {}
    Pose at(const Frame& frame) const override { return ++queries, pose_(frame.time); }
    FrameRange range() const override { return {-INFINITY, INFINITY}; }

    mutable int queries = 0;

private:
    std::function<Pose(double)> pose_;
};

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) { return a.angularDistance(b); }

// Returns a motion as a script creates it, with its pose and its rotations.
MotionPtr rotation_by(const Vec3d& axis, double angle)
{
    return constant_motion({{0, 0, 0}, about(axis, angle)}, Turns{{axis.normalized(), angle}});
}

MotionPtr keyed_from(const MotionPtr& first, const MotionPtr& last)
{
    std::map<std::int64_t, Turns> turns;
    if (turns_of(*first)) turns[1] = *turns_of(*first);
    if (turns_of(*last)) turns[11] = *turns_of(*last);
    return keyed_motion({{1, first->at({})}, {11, last->at({})}}, turns);
}

}  // namespace

TEST_CASE("a pose maps as its affine map does, and its inverse undoes it", "[motion]")
{
    const Pose pose{{1, -2, 3}, about({1, 2, 3}, 1.1), 2.5};
    const Vec3d X(0.3, -0.7, 1.9);
    CHECK_THAT(pose * X, close_to(Vec3d(pose.affine() * X), 1e-14));
    CHECK_THAT(pose.inverse() * (pose * X), close_to(X, 1e-14));

    const Pose other{{-4, 0, 1}, about({0, 1, -1}, -2.0), 0.5};
    CHECK_THAT((pose * other) * X, close_to(Vec3d(pose.affine() * other.affine() * X), 1e-14));
}

TEST_CASE("between keys translation and scale are linear and rotation is slerp; outside they are constant", "[motion]")
{
    const Vec3d axis = Vec3d(1, 1, 0).normalized();
    const MotionPtr motion = keyed_motion({{5, {{0, 0, 0}, about(axis, 0), 1}}, {9, {{4, 8, -4}, about(axis, 2), 3}}});
    CHECK(motion->varies());
    CHECK(motion->range().first == 5);
    CHECK(motion->range().last == 9);

    for (const double number : {5.0, 5.25, 7.0, 8.5, 9.0}) {
        CAPTURE(number);
        const double t = (number - 5) / 4;
        const Pose pose = motion->at(clock_24.at(number));
        CHECK_THAT(pose.translation, close_to(Vec3d(t * Vec3d(4, 8, -4)), 1e-14));
        CHECK(pose.scale == Approx(1 + 2 * t));
        CHECK(angle_between(pose.rotation, about(axis, 2 * t)) < 1e-12);
    }
    CHECK(motion->at(clock_24.at(-10)).translation == Vec3d(0, 0, 0));
    CHECK(motion->at(clock_24.at(100)).translation == Vec3d(4, 8, -4));
    CHECK_FALSE(keyed_motion({{3, {{1, 2, 3}}}})->varies());
    CHECK_THROWS_AS(keyed_motion({}), Error);
}

TEST_CASE("keys that turn about one axis are joined by their angles, whole turns included", "[motion]")
{
    const Vec3d axis = Vec3d(1, -2, 0.5).normalized();
    const double angle = GENERATE(0.5, 2.0, 1.0001 * pi, 200 * pi / 180, -1.5 * pi, 2 * pi, 4 * pi, -9 * pi);
    const MotionPtr start = rotation_by(axis, 0.3), end = rotation_by(axis, 0.3 + angle);
    const MotionPtr placed = constant_motion({{3, 1, -2}, Eigen::Quaterniond::Identity(), 2});
    const MotionPtr tilt = rotation_by({0, 0, 1}, 0.7);  // the same additional rotation in each key, about another axis
    for (int step = 0; step <= 10; ++step) {
        CAPTURE(angle, step);
        const double now = angle * step / 10;
        const auto turn_of = [&](const MotionPtr& motion) { return motion->at(clock_24.at(1 + step)).rotation; };
        CHECK(angle_between(turn_of(keyed_from(start, end)), about(axis, 0.3 + now)) < 1e-9);
        CHECK(angle_between(turn_of(keyed_from(start, rotation_by(-axis, -0.3 - angle))), about(axis, 0.3 + now)) <
              1e-9);
        CHECK(angle_between(turn_of(keyed_from(constant_motion({}), rotation_by(axis, angle))), about(axis, now)) <
              1e-9);
        CHECK(angle_between(turn_of(keyed_from(rotation_by(axis, angle), placed)), about(axis, angle - now)) < 1e-9);
        const MotionPtr twice =
            product(placed, product(rotation_by(axis, 0.5 * angle), rotation_by(axis, 0.5 * angle)));
        CHECK(angle_between(turn_of(keyed_from(placed, twice)), about(axis, now)) < 1e-9);
        const MotionPtr spinning = keyed_from(product(start, tilt), product(end, tilt));
        CHECK(angle_between(turn_of(spinning), about(axis, 0.3 + now) * about({0, 0, 1}, 0.7)) < 1e-9);
    }
}

TEST_CASE("keys that turn about different axes are joined by the shorter way", "[motion]")
{
    const MotionPtr motion = keyed_from(rotation_by({1, 0, 0}, 1.5 * pi), rotation_by({0, 1, 0}, 1.75 * pi));
    const Eigen::Quaterniond middle = about({1, 0, 0}, -pi / 2).slerp(0.5, about({0, 1, 0}, -pi / 4));
    CHECK(angle_between(motion->at(clock_24.at(6)).rotation, middle) < 1e-9);
}

TEST_CASE("a track goes with keys through several turns in a frame", "[motion]")
{
    const Vec3d axis = Vec3d(0, 1, 2).normalized();
    const MotionPtr motion = keyed_from(rotation_by(axis, 0), rotation_by(axis, 30 * pi));
    const MotionTrack track(*motion, clock_24, 4, 5);
    for (const double u : {0.0, 0.1, 0.45, 0.75, 1.0}) {
        CAPTURE(u);
        CHECK(angle_between(track.at(u / 24).rotation, about(axis, 3 * pi * (3 + u))) < 1e-4);
        CHECK_THAT(track.velocity_at(u / 24).angular, close_to(Vec3d(3 * pi * 24 * axis), 1e-3 * 3 * pi * 24));
    }
}

TEST_CASE("a product of constants is a constant, and moves first by its right factor", "[motion]")
{
    const MotionPtr turned_then_moved =
        product(constant_motion({{1, 0, 0}}), constant_motion({{0, 0, 0}, about({0, 0, 1}, pi / 2)}));
    CHECK_FALSE(turned_then_moved->varies());
    CHECK_THAT(turned_then_moved->at({}) * Vec3d(1, 0, 0), close_to(Vec3d(1, 1, 0), 1e-15));

    const MotionPtr moving = product(constant_motion({{1, 0, 0}}), keyed_motion({{1, {}}, {2, {{0, 1, 0}}}}));
    CHECK(moving->varies());
    CHECK_THAT(moving->at(clock_24.at(1.5)).translation, close_to(Vec3d(1, 0.5, 0), 1e-15));
}

TEST_CASE("a track of a falling, spinning body is one piece, and exact between its samples", "[motion]")
{
    const Vec3d v(3, -1, 2), g(0, -9.81, 0), spin(1, 20, -3);
    const Formula motion([&](double t) {
        return Pose{Vec3d(5, 5, 5) + t * v + 0.5 * t * t * g, about(spin, spin.norm() * t), 1 + 2 * t};
    });
    const MotionTrack track(motion, clock_24, 7, 8);
    REQUIRE(track.pieces().size() == 1);
    CHECK(track.duration() == Approx(1.0 / 24));
    for (const double s : {0.0, 0.01, 0.031, 1.0 / 24}) {
        CAPTURE(s);
        const double t = 6.0 / 24 + s;
        const Pose queries = motion.at({0, t, 0}), read = track.at(s);
        CHECK_THAT(read.translation, close_to(queries.translation, 1e-12));
        CHECK(angle_between(read.rotation, queries.rotation) < 1e-7);  // the square root of rounding
        CHECK(read.scale == Approx(queries.scale).epsilon(1e-13));
        const VelocityField field = track.velocity_at(s);
        CHECK_THAT(field.linear, close_to(Vec3d(v + t * g), 1e-9));
        CHECK_THAT(field.angular, close_to(spin, 1e-9));
        CHECK(field.growth == Approx(2 / (1 + 2 * t)));
    }
}

TEST_CASE(
    "a track of an orbit is within a hundred-thousandth of its length, and its velocity field is that of the orbit",
    "[motion]")
{
    const double speed = GENERATE(0.1, 5.0, 40.0, 200.0);  // rad/s; the last is more than a turn per frame
    CAPTURE(speed);
    const Formula orbit([&](double t) {
        const Pose turn{Vec3d::Zero(), about({0, 1, 0}, speed * t)};
        return turn * Pose{{3, 0, 0}};
    });
    const MotionTrack track(orbit, clock_24, 2, 3);
    const double way = std::min(12.0, 3 * speed / 24);  // two chords are at most two diameters
    for (int i = 0; i <= 100; ++i) {
        const double s = i / 100.0 / 24;
        const Pose queries = orbit.at({0, 1.0 / 24 + s, 0});
        CHECK_THAT(track.at(s).translation, close_to(queries.translation, 1.1e-5 * way));
        const Vec3d x = queries * Vec3d(0.5, 0.2, 0.1);
        CHECK_THAT(track.velocity_at(s).at(x), close_to(Vec3d(Vec3d(0, speed, 0).cross(x)), 0.005 * 4 * speed));
    }
}

TEST_CASE("a motion that jumps is evaluated a bounded number of times", "[motion][extreme]")
{
    const Formula jump([](double t) { return Pose{{t < 1.02 ? 0.0 : 1e6, 0, 0}}; });
    const MotionTrack track(jump, clock_24, 25, 26);
    CHECK(track.pieces().size() <= 64);
    CHECK(jump.queries <= 200);
    CHECK(track.at(0).translation.x() == 0);
    CHECK_THAT(track.at(1.0 / 24).translation, close_to(Vec3d(1e6, 0, 0), 1e-6));
}

TEST_CASE("a placed shape has the distances and contacts of the shape built there", "[motion]")
{
    const Pose pose{{2, -1, 0.5}, about({3, 1, -2}, 0.8), 1.5};
    const Vec3d center(0.2, 0.1, -0.3);
    const ShapePtr there = make_sphere_shape(1.5 * 0.7, pose * center);
    const ShapePtr moved = placed(make_sphere_shape(0.7, center), pose);

    const std::vector<Vec3d> P{{0, 0, 0}, {2, -1, 2.5}, {9, 9, 9}};
    std::vector<double> phi(3), expected(3);
    std::vector<Vec3d> gradient(3), expected_gradient(3);
    moved->distance(P, phi, gradient);
    there->distance(P, expected, expected_gradient);
    const std::vector<Path> paths{{{2, -1, 5}, {0.1, 0, -10}, {0, -9.81, 0}, 1, 0.05},
                                  {{2, 5, 0.5}, {0, 0, 0}, {0, -9.81, 0}, 2, 0},
                                  {{2, 5, 0.5}, {0, 9, 0}, {0, 0, 0}, 2, 0}};
    std::vector<Contact> contacts(3), expected_contacts(3);
    moved->first_contact(paths, contacts);
    there->first_contact(paths, expected_contacts);
    for (int i = 0; i < 3; ++i) {
        CAPTURE(i);
        CHECK(phi[i] == Approx(expected[i]).epsilon(1e-12));
        CHECK_THAT(gradient[i], close_to(expected_gradient[i], 1e-12));
        if (expected_contacts[i].time == Contact::none)
            CHECK(contacts[i].time == Contact::none);
        else
            CHECK(contacts[i].time == Approx(expected_contacts[i].time).epsilon(1e-9));
        CHECK_THAT(contacts[i].n, close_to(expected_contacts[i].n, 1e-9));
        CHECK(contacts[i].curvature == Approx(expected_contacts[i].curvature).margin(1e-5));
    }
    for (int axis = 0; axis < 3; ++axis) {
        CHECK(moved->bounds().min()[axis] <= there->bounds().min()[axis] + 1e-12);
        CHECK(moved->bounds().max()[axis] >= there->bounds().max()[axis] - 1e-12);
    }
}

TEST_CASE("a placed plane is the half space that its pose gives", "[motion]")
{
    const Pose pose{{0, 2, 0}, about({0, 0, 1}, pi / 2), 3};
    const ShapePtr moved = placed(make_plane({0, 1, 0}, 1), pose);  // y <= 1 becomes -x <= 3
    const std::vector<Vec3d> P{{0, 0, 0}, {-5, 7, 1}};
    std::vector<double> phi(2);
    moved->distance(P, phi, {});
    CHECK(phi[0] == Approx(-3));
    CHECK(phi[1] == Approx(2));
    CHECK(moved->bounds().contains(Vec3d(100, 100, 100)));
    CHECK(placed(make_plane({0, 1, 0}, 1), {{0, 2, 0}})->bounds().max().y() == 3);
}
