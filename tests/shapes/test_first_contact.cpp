#include "runtime/shapes/first_contact.h"

#include <cmath>
#include <random>

#include "runtime/shapes/analytic/analytic.h"
#include "runtime/shapes/level_set/level_set.h"
#include "tests/test.h"

namespace rapid {
namespace {

using test::close_to;

Contact meet(const ShapePtr& shape, const Path& path)
{
    Contact contact;
    shape->first_contact({&path, 1}, {&contact, 1});
    return contact;
}

double distance_to(const ShapePtr& shape, const Vec3d& P)
{
    double phi;
    shape->distance({&P, 1}, {&phi, 1}, {});
    return phi;
}

class Random {
public:
    explicit Random(unsigned seed) : engine_(seed) {}
    double in(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(engine_); }
    Vec3d direction()
    {
        std::normal_distribution<double> normal;
        return Vec3d(normal(engine_), normal(engine_), normal(engine_)).normalized();
    }

private:
    std::mt19937_64 engine_;
};

// Returns a path that starts around a shape of this size, heads roughly towards it, and is curved by an acceleration.
Path path_to(const Vec3d& center, Random& random, double radius)
{
    const Vec3d P = center + random.in(1, 3) * random.direction();
    const Vec3d v = random.in(0.5, 4) * (center + random.in(0, 1.5) * random.direction() - P);
    return {P, v, random.in(0, 20) * random.direction(), 1, radius};
}

Vec3d on_path(const Path& path, double s) { return path.P + s * path.v + s * s / 2 * path.a; }

TEST_CASE("a ball meets a plane at the root of its parabola", "[first_contact]")
{
    const double height = GENERATE(1e-3, 1.0, 1e5), speed = GENERATE(-30.0, 0.0, 4.0), radius = GENERATE(0.0, 1e-4);
    CAPTURE(height, speed, radius);
    const Path path{{7, height, 1}, {1, speed, 0}, {0, -9.81, 0}, 1e9, radius};
    const Contact contact = meet(make_plane({0, 1, 0}, 0), path);

    const long double f = height - radius, g = 9.81;
    const long double root = (speed + std::sqrt(speed * speed + 2 * g * f)) / g;
    CHECK(contact.time == Approx(double(root)).epsilon(1e-13));
    CHECK(contact.n == Vec3d(0, 1, 0));
    CHECK(contact.flat);
}

TEST_CASE("a path that turns before it reaches a plane does not meet it", "[first_contact]")
{
    const ShapePtr plane = make_plane({0, 1, 0}, 0);
    const Vec3d lift(0, 10, 0);
    // The path turns at height 1 - v²/20, so it grazes the plane at v = √20.
    CHECK(meet(plane, {{0, 1, 0}, {0, -4.47, 0}, lift, 10, 0}).time == Contact::none);
    CHECK(meet(plane, {{0, 1, 0}, {0, -4.48, 0}, lift, 10, 0}).time == Approx(0.448 - std::sqrt(0.448 * 0.448 - 0.2)));
    CHECK(meet(plane, {{0, 1, 0}, {0, -4.48, 0}, lift, 0.3, 0}).time == Contact::none);  // it ends too early
}

TEST_CASE("a straight path meets a sphere at the root of its quadratic", "[first_contact]")
{
    Random random(1);
    int met = 0;
    for (int i = 0; i < 2000; ++i) {
        const Vec3d center = 3 * random.direction();
        const double R = random.in(0.01, 2), r = i % 2 ? random.in(0, 0.5) : 0;
        const Vec3d P = center + (R + r + random.in(1e-3, 10)) * random.direction();
        const Vec3d v =
            random.in(0.1, 1000) * (center + random.in(0, 1.2) * (R + r) * random.direction() - P).normalized();
        const Contact contact = meet(make_sphere_shape(R, center), {P, v, Vec3d::Zero(), 1e6, r});

        const Vec3d d = P - center;
        const double b = d.dot(v), c = d.squaredNorm() - (R + r) * (R + r), a = v.squaredNorm();
        const double discriminant = b * b - a * c;
        CAPTURE(i, discriminant);
        if (std::abs(discriminant) < 1e-9 * b * b) continue;  // a graze, which depends on rounding
        if (discriminant < 0) {
            CHECK(contact.time == Contact::none);
            continue;
        }
        ++met;
        const double root = c / (-b + std::sqrt(discriminant));
        CHECK(contact.time == Approx(root).epsilon(1e-9));
        CHECK_THAT(contact.n, close_to(Vec3d((P + root * v - center).normalized()), 1e-7));
        // The curvature of the offset surface at this radius, from a difference over a millionth of the sphere's size.
        CHECK(contact.curvature == Approx(1 / (R + r)).epsilon(1e-4));
    }
    CHECK(met > 500);
}

// Checks in small steps that the contact is on the surface and that the path was outside until then.
void require_first(const ShapePtr& shape, const Path& path, const Contact& contact, double tolerance)
{
    const double until = std::min(contact.time, path.duration);
    double lowest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 2000; ++k) lowest = std::min(lowest, distance_to(shape, on_path(path, until * k / 2000)));
    REQUIRE(lowest >= path.radius - tolerance);
    if (contact.time == Contact::none) return;
    REQUIRE(contact.time <= path.duration);
    REQUIRE(distance_to(shape, on_path(path, contact.time)) == Approx(path.radius).margin(tolerance));
    REQUIRE(contact.n.norm() == Approx(1));
}

TEST_CASE("parabolas meet spheres and boxes where they first touch them", "[first_contact]")
{
    const ShapePtr shape =
        GENERATE(make_sphere_shape(0.7, {0.1, 0.2, 0.3}), make_box_shape({1, 0.4, 2}, {0.1, 0.2, 0.3}));
    CAPTURE(shape->kind());
    Random random(2);
    int met = 0, missed = 0;
    for (int i = 0; i < 300; ++i) {
        const double radius = i % 3 ? random.in(0, 0.3) : 0;
        const Path path = path_to({0.1, 0.2, 0.3}, random, radius);
        if (distance_to(shape, path.P) < radius) continue;
        CAPTURE(i);
        const Contact contact = meet(shape, path);
        require_first(shape, path, contact, 1e-9);
        (contact.time == Contact::none ? missed : met)++;
    }
    CHECK(met > 50);
    CHECK(missed > 50);
}

TEST_CASE("a point flush with a surface is outside it", "[first_contact]")
{
    const ShapePtr shape = GENERATE(make_plane({0, 1, 0}, 1), make_sphere_shape(1, {0, 0, 0}),
                                    make_box_shape({2, 2, 2}, {0, 0, 0}), level_set_sphere(1, {0, 0, 0}, {0.05, 3}));
    const double off = GENERATE(-1e-7, 0.0, 1e-7);  // the rounding of a position to single precision
    CAPTURE(shape->kind(), off);
    Vec3d P(0, 1, 0);
    P.y() += off - distance_to(shape, P);  // on the field's own surface, which may not be exactly at 1
    const Vec3d pull(0, -9.81, 0), none(0, 0, 0);

    CHECK(meet(shape, {P, {0, 1, 0}, none, 1, 0}).time == Contact::none);    // leaves
    CHECK(meet(shape, {P, {0, 1, 0}, pull, 0.1, 0}).time == Contact::none);  // leaves, and does not return in this time
    CHECK(meet(shape, {P, {0, 3, 0}, pull, 1, 0}).time == Approx(6 / 9.81).epsilon(1e-5));  // leaves and returns
    CHECK(meet(shape, {P, {0, -1, 0}, none, 1, 0}).time == 0);                              // moves in
    CHECK(meet(shape, {P, none, pull, 1, 0}).time == 0);                                    // is pressed in
    CHECK(meet(shape, {P, {0, 1e-6, 0}, pull, 1, 0}).time == 0);              // hops by less than rounding
    CHECK(meet(shape, {P, none, none, 1, 0}).time == Contact::none);          // stays
    CHECK(meet(shape, {P, none, {0, 9.81, 0}, 1, 0}).time == Contact::none);  // is pulled off
    CHECK(meet(shape, {P, {0, -1, 0}, none, 1, 0}).depth == 0);
}

TEST_CASE("a fast point that is pressed to a ball leaves it tangentially", "[first_contact]")
{
    const ShapePtr ball = make_sphere_shape(1, {0, 0, 0});
    const Vec3d top(0, 1, 0), pull(0, -9.81, 0);
    CHECK(meet(ball, {top, {3, 0, 0}, pull, 1, 0}).time == 0);                // v² < g R
    CHECK(meet(ball, {top, {3.3, 0, 0}, pull, 1, 0}).time == Contact::none);  // v² > g R
}

TEST_CASE("a path that starts inside has the depth and the direction out of the shape", "[first_contact]")
{
    const Path path{{0.5, 0.2, 0}, {0, 0, 3}, {0, 0, 0}, 1, 0.1};
    const Contact in_box = meet(make_box_shape({2, 2, 2}, {0, 0, 0}), path);
    CHECK(in_box.time == 0);
    CHECK(in_box.depth == Approx(0.6));
    CHECK(in_box.n == Vec3d(1, 0, 0));
    const Contact in_plane = meet(make_plane({0, 1, 0}, 1), path);
    CHECK(in_plane.depth == Approx(0.9));
    CHECK(in_plane.n == Vec3d(0, 1, 0));
}

TEST_CASE("deep in a level set the way out leads towards the nearest surface", "[first_contact]")
{
    const Vec3d center(0.1, 0.2, 0.3);
    const ShapePtr ball = level_set_sphere(1, center, {0.05, 3});
    Random random(5);
    for (int k = 0; k < 200; ++k) {
        const Vec3d P = center + random.in(0, 0.7) * random.direction();
        const Contact contact = meet(ball, {P, {0, 0, -4}, {0, 0, 0}, 1, 0});
        CHECK(contact.time == 0);
        // One voxel inside the surface at most, and no farther from P than the surface, up to a voxel across.
        const double r = (P + contact.depth * contact.n - center).norm();
        CHECK(r > 1 - 1.01 * 0.05);
        CHECK(r < 1);
        CHECK(contact.depth < 1 - (P - center).norm() + 0.02);
    }
}

TEST_CASE("paths meet a level set where they first touch its field", "[first_contact]")
{
    const ShapePtr shape = GENERATE(level_set_sphere(0.7, {0.1, 0.2, 0.3}, {0.05, 5}),
                                    level_set_box({1, 0.4, 2}, {0.1, 0.2, 0.3}, {0.05, 5}),
                                    level_set_torus(0.8, 0.25, {0, 0, 0}, {0.05, 5}));
    Random random(3);
    int met = 0;
    for (int i = 0; i < 200; ++i) {
        const double radius = i % 3 ? random.in(0, 0.1) : 0;
        const Path path = path_to({0.1, 0.2, 0.3}, random, radius);
        if (distance_to(shape, path.P) < radius) continue;
        CAPTURE(i);
        const Contact contact = meet(shape, path);
        met += contact.time != Contact::none;
        // A graze with a chord of a quarter voxel may be stepped over. Its depth is 0.0125²/(8 · 0.25) on the torus'
        // tube, and half its length at an edge.
        require_first(shape, path, contact, 7e-3);
        if (contact.time != Contact::none)
            REQUIRE(distance_to(shape, on_path(path, contact.time)) == Approx(radius).margin(1e-6));
    }
    CHECK(met > 40);
}

TEST_CASE("a path that leaves a surface meets the next one where it reaches it, even within the same voxel",
          "[first_contact]")
{
    // On the inside of the tube the surface curves towards a departing path, with kinks between cells.
    const ShapePtr shape = level_set_torus(0.8, 0.25, {0, 0, 0}, {0.05, 5});
    Random random(5);
    int again = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3d to = 0.8 * Vec3d(random.in(-1, 1), 0, random.in(-1, 1)).normalized();
        const Path in{{0, 0, 0}, to - Vec3d(0, random.in(-0.1, 0.1), 0), Vec3d::Zero(), 1, 0};
        const Contact first = meet(shape, in);
        REQUIRE(first.time < 1);
        const Vec3d across = first.n.cross(Vec3d::UnitY()).normalized();
        const Path out{on_path(in, first.time), across + std::pow(10, random.in(-4, -1)) * first.n, Vec3d::Zero(), 2,
                       0};
        const Contact second = meet(shape, out);
        CAPTURE(i, second.time, out.v.dot(first.n));
        REQUIRE(second.time < out.duration);  // the path is in the hole
        // A slower path returns before it has left by more than rounding.
        REQUIRE(second.n.dot(out.v) < 1e-3);
        again += second.time < 0.05;
    }
    CHECK(again > 1000);
}

TEST_CASE("nothing goes through a wall of two voxels, at any speed", "[first_contact][extreme]")
{
    const double voxel = 0.1;
    const ShapePtr wall = level_set_box({2 * voxel, 4, 4}, {0.013, 0, 0}, {voxel, 3});
    const double speed = std::pow(10.0, GENERATE(range(-1, 8)));
    CAPTURE(speed);
    Random random(4);
    for (int i = 0; i < 300; ++i) {
        const Vec3d from(-random.in(0.5, 3), random.in(-1, 1), random.in(-1, 1)),
            to(3, random.in(-1, 1), random.in(-1, 1));
        const Vec3d v = speed * (to - from).normalized();
        const Vec3d a =
            random.in(0, 0.1) * speed * speed * random.direction();  // curved, with a deviation of up to 0.05 length²
        const Path path{from, v, a, (to - from).norm() / speed, 0};
        if (on_path(path, path.duration).x() < 0.3) continue;  // curved back, or not through yet
        const Contact contact = meet(wall, path);
        CAPTURE(i);
        REQUIRE(contact.time < path.duration);
        REQUIRE(on_path(path, contact.time).x() == Approx(0.013 - voxel).margin(0.2 * voxel));
    }
}

TEST_CASE("a path that starts at rest meets the shape below it, or ends, at any acceleration",
          "[first_contact][extreme]")
{
    const ShapePtr ball = level_set_sphere(0.7, {0, 0, 0}, {0.05, 5});
    const double a = std::pow(10.0, GENERATE(range(-1, 35)));
    const double duration = 1e3;  // s; the path is up to 1e40 m long
    CAPTURE(a);
    const Path there{{3, 0, 0}, {0, 0, 0}, {-a, 0, 0}, duration, 0},
        away{{3, 0, 0}, {0, 0, 0}, {a, 0.1 * a, 0}, duration, 0};

    const Contact contact = meet(ball, there);

    CHECK(contact.time == Approx(std::sqrt(2 * 2.3 / a)).epsilon(1e-3));  // the field's error is a tenth of a voxel
    CHECK(meet(ball, away).time == Contact::none);
}

TEST_CASE("a path that is at rest just above a surface meets it, at any acceleration", "[first_contact][extreme]")
{
    const ShapePtr ball = level_set_sphere(0.7, {0, 0, 0}, {0.1, 5});
    const double above = GENERATE(1e-4, 1e-3, 0.02), a = std::pow(10.0, GENERATE(range(-1, 35)));
    const double duration = GENERATE(1.0 / 24, 10.0);
    CAPTURE(above, a, duration);
    const Vec3d P(0.7 + above, 0, 0);
    double phi = 0;
    ball->distance({&P, 1}, {&phi, 1}, {});
    const Contact contact = meet(ball, {P, {0, 0, 0}, {-a, 0, 0}, duration, 0});
    const double time = std::sqrt(2 * phi / a);
    if (time < 0.9 * duration) CHECK(contact.time == Approx(time).epsilon(0.1));
    if (time > 1.1 * duration) CHECK(contact.time == Contact::none);
}

TEST_CASE("no contact is found outside the bounds, and one inside is found from any distance", "[first_contact]")
{
    const ShapePtr ball = level_set_sphere(1, {0, 0, 0}, {0.05, 3});
    CHECK(meet(ball, {{1e6, 0, 0}, {-1e6, 0, 0}, {0, 0, 0}, 2, 0}).time == Approx(1 - 1e-6).epsilon(1e-9));
    CHECK(meet(ball, {{1e6, 1.3, 0}, {-1e6, 0, 0}, {0, 0, 0}, 2, 0}).time == Contact::none);
    CHECK(meet(ball, {{1e6, 1.3, 0}, {-1e6, 0, 0}, {0, 0, 0}, 2, 0.31}).time < 1);
    CHECK(meet(ball, {{5, 0, 0}, {1e6, 0, 0}, {0, 1e6, 0}, 10, 0}).time == Contact::none);
}

TEST_CASE("a contact does not depend on the other paths of the query", "[first_contact]")
{
    const ShapePtr shape = GENERATE(make_plane({0.2, 1, 0}, 0), make_sphere_shape(1, {0, 0, 0}),
                                    level_set_torus(0.8, 0.25, {0, 0, 0}, {0.05, 3}));
    Random random(6);
    std::vector<Path> paths;
    for (int i = 0; i < 100; ++i)
        paths.push_back({2 * random.direction(), 10 * random.direction(), 10 * random.direction(), 1, 0.01});
    std::vector<Contact> together(paths.size());
    shape->first_contact(paths, together);
    for (std::size_t i = 0; i < paths.size(); ++i) {
        const Contact alone = meet(shape, paths[i]);
        CHECK(alone.time == together[i].time);
        CHECK(alone.n == together[i].n);
    }
}

}  // namespace
}  // namespace rapid
