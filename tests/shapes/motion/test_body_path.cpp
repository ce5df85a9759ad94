#include "runtime/shapes/motion/body_path.h"

#include <cmath>

#include "runtime/shapes/analytic/analytic.h"
#include "tests/test.h"

using namespace rapid;
using rapid::test::close_to;

namespace {

constexpr double everywhere = std::numeric_limits<double>::infinity();
const FrameClock film_clock{24, 1};

// Returns the curve of one point through four frames.
Cubic<Vec3d> through(const FramePath& path, const std::function<Vec3d(double)>& place, double frame)
{
    return path.through<Vec3d>(place(frame - 2), place(frame - 1), place(frame), place(frame + 1));
}

FramePath curved(bool before = true, bool after = true, double alpha = 0.5)
{
    return {FramePath::Curved, alpha, before, after, std::nullopt};
}

// Finds the path of a body that travels 1 m per frame, except in the frames of `other`.
FramePath found(std::int64_t frame, const std::map<std::int64_t, double>& other, double size,
                const PathOptions& options = {}, FrameRange range = {-everywhere, everywhere})
{
    return FramePath::find(frame, range, options, size, [&](std::int64_t i) {
        const auto step = other.find(i);
        return step == other.end() ? 1.0 : step->second;
    });
}

}  // namespace

TEST_CASE("the spline of a uniform motion or acceleration is that motion, at one-sided ends too", "[path]")
{
    const Vec3d P(1, 2, 3), v(0.3, -0.2, 0.1);
    const Vec3d a = GENERATE(Vec3d(0, 0, 0), Vec3d(0.05, -0.4, 0.2));
    const auto place = [&](double f) -> Vec3d { return P + f * v + 0.5 * f * f * a; };
    const bool before = GENERATE(true, false), after = GENERATE(true, false);
    CAPTURE(before, after);
    if (!before && !after && !a.isZero()) return;  // two positions give a straight line, whatever happens in between
    const Cubic<Vec3d> cubic = through(curved(before, after), place, 7);
    for (const double t : {0.0, 0.25, 0.7, 1.0}) {
        CHECK_THAT(cubic.at(t), close_to(place(6 + t), 1e-13));
        CHECK_THAT(cubic.derivative(t), close_to(Vec3d(v + (6 + t) * a), 1e-13));
    }
}

TEST_CASE(
    "on a circle the spline's error falls with the third power of the frame angle, the velocity's with the second",
    "[path]")
{
    const auto errors = [](double angle) {
        const auto place = [&](double f) { return Vec3d(std::cos(angle * f), std::sin(angle * f), 0); };
        const Cubic<Vec3d> cubic = through(curved(), place, 3);
        double worst = 0, middle = 0, speed = 0;
        for (int i = 0; i <= 100; ++i) {
            const double t = i / 100.0;
            const Vec3d tangent = angle * Vec3d(-place(2 + t).y(), place(2 + t).x(), 0);
            worst = std::max(worst, (cubic.at(t) - place(2 + t)).norm());
            speed = std::max(speed, (cubic.derivative(t) - tangent).norm() / angle);
            if (i == 50) middle = (cubic.at(t) - place(2 + t)).norm();
        }
        return std::array{worst, middle, speed};
    };
    const auto coarse = errors(0.2), fine = errors(0.1);
    CHECK(std::log2(coarse[0] / fine[0]) == Approx(3).margin(0.1));
    CHECK(std::log2(coarse[1] / fine[1]) == Approx(4).margin(0.1));
    CHECK(std::log2(coarse[2] / fine[2]) == Approx(2).margin(0.1));
    CHECK(coarse[0] < 0.2 * 0.2 * 0.2 / 20);
}

TEST_CASE("the derivative is that of the curve", "[path]")
{
    rc::prop("by differences", [] {
        const auto coordinate = [] { return *rc::gen::inRange(-1000, 1000) / 100.0; };
        const auto place = [&] { return Vec3d(coordinate(), coordinate(), coordinate()); };
        const Cubic<Vec3d> cubic = curved().through<Vec3d>(place(), place(), place(), place());
        const double t = *rc::gen::inRange(10, 990) / 1000.0, d = 1e-5;
        RC_ASSERT(((cubic.at(t + d) - cubic.at(t - d)) / (2 * d) - cubic.derivative(t)).norm() < 1e-6);
    });
}

TEST_CASE("neighbouring frames share position and velocity where they meet", "[path]")
{
    const auto place = [](double f) { return Vec3d(std::sin(f), f * f * 0.1, std::cos(2 * f)); };
    const Cubic<Vec3d> one = through(curved(), place, 4), next = through(curved(), place, 5);
    CHECK_THAT(one.at(1), close_to(next.at(0), 1e-14));
    CHECK_THAT(one.derivative(1), close_to(next.derivative(0), 1e-14));
}

TEST_CASE("a point at rest has exactly the velocity 0, whatever the ends", "[path]")
{
    const Vec3d P(0.1, 1e5 / 3, -7e-9);
    for (const FramePath& path :
         {curved(), curved(false), curved(true, false), curved(false, false), curved(true, true, 0.3),
          FramePath{FramePath::AfterCut, 0.5, true, true, {}}, FramePath{FramePath::Straight}}) {
        const Cubic<Vec3d> cubic = path.through<Vec3d>(P, P, P, P);
        for (const double t : {0.0, 0.3, 1.0}) {
            CHECK(cubic.at(t) == P);
            CHECK(cubic.derivative(t) == Vec3d::Zero());
        }
    }
}

TEST_CASE("a jump is a step of eight times those around it and of half the body's size", "[path]")
{
    CHECK(found(10, {{10, 8.5}}, 2).kind == FramePath::AfterCut);
    REQUIRE(found(10, {{10, 8.5}}, 2).jump);
    CHECK(found(10, {{10, 8.5}}, 2).jump->distance == 8.5);
    CHECK(found(10, {{10, 8.5}}, 2).jump->usual == 1);
    CHECK(found(10, {{10, 7.5}}, 2).kind == FramePath::Curved);             // not far enough for a jump
    CHECK(found(10, {{10, 8.5}}, 20).kind == FramePath::Curved);            // the body moves by only a part of its size
    CHECK(found(10, {{10, 8.5}, {11, 8.5}}, 2).kind == FramePath::Curved);  // it starts to move fast and continues
    CHECK(found(10, {{9, 0}, {10, 0.1}, {11, 0.3}}, 0).kind == FramePath::Curved);

    const FramePath before = found(9, {{10, 8.5}}, 2), after = found(11, {{10, 8.5}}, 2);
    CHECK((before.kind == FramePath::Curved && before.before && !before.after && !before.jump));
    CHECK((after.kind == FramePath::Curved && !after.before && after.after && !after.jump));
}

TEST_CASE("cuts that are given are the jumps, and no others are detected", "[path]")
{
    PathOptions options;
    options.cuts = std::set<std::int64_t>{12};
    CHECK(found(12, {{10, 100}}, 1, options).kind == FramePath::AfterCut);
    CHECK_FALSE(found(12, {{10, 100}}, 1, options).jump);
    CHECK(found(10, {{10, 100}}, 1, options).kind == FramePath::Curved);
    CHECK_FALSE(found(11, {}, 1, options).after);
}

TEST_CASE("beyond the ends of a motion the body rests, and its last interval has a one-sided end", "[path]")
{
    const FrameRange range{5, 9};
    CHECK(found(5, {}, 1, {}, range).kind == FramePath::Still);
    CHECK(found(10, {}, 1, {}, range).kind == FramePath::Still);
    CHECK_FALSE(found(6, {}, 1, {}, range).before);
    CHECK(found(6, {}, 1, {}, range).after);
    CHECK(found(9, {}, 1, {}, range).before);
    CHECK_FALSE(found(9, {}, 1, {}, range).after);
}

TEST_CASE("after a jump the body has arrived straight along the path on which it continues", "[path]")
{
    const FramePath path{FramePath::AfterCut, 0.5, true, true, std::nullopt};
    const Vec3d v(0.5, 0, 0);
    const Cubic<Vec3d> cubic = path.through<Vec3d>({-9, 0, 0}, {-8.5, 0, 0}, {100, 1, 0}, Vec3d(100, 1, 0) + v);
    CHECK_THAT(cubic.at(1), close_to(Vec3d(100, 1, 0), 1e-13));
    CHECK_THAT(cubic.at(0.2), close_to(Vec3d(99.6, 1, 0), 1e-13));
    CHECK_THAT(cubic.derivative(0.2), close_to(v, 1e-13));
}

TEST_CASE("a turning body carries births along arcs, and their normals turn with it", "[path]")
{
    const auto turned = [](double angle) {
        return Pose{{0, 0, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vec3d::UnitZ())), 2};
    };
    const double angle = 0.1;  // rad per frame
    const MotionPtr motion = keyed_motion({{1, turned(0)}, {11, turned(10 * angle)}});
    const AnimatedShape shape(make_sphere_shape(1, {3, 0, 0}), motion);
    const FramePath path = path_of(shape, film_clock, 5, {});
    REQUIRE(path.kind == FramePath::Curved);
    std::vector<Birthplace> birthplaces(3);
    for (Birthplace& place : birthplaces) place.P = {4, 0, 0}, place.N = {1, 0, 0};
    std::vector<Vec3d> velocity(3);
    const std::vector<double> t{0, 0.5, 1};
    rigid_path(*motion, film_clock, 5, path)->carry(t, true, birthplaces, velocity);
    for (int i = 0; i < 3; ++i) {
        const double at = angle * (3 + t[i]);
        const Vec3d out(std::cos(at), std::sin(at), 0), along(-out.y(), out.x(), 0);
        CHECK_THAT(birthplaces[i].P, close_to(Vec3f((8 * out).cast<float>()), 8 * angle * angle * angle / 20));
        CHECK_THAT(birthplaces[i].N, close_to(Vec3f(out.cast<float>()), 1e-4));
        CHECK_THAT(velocity[i], close_to(Vec3d(8 * angle * along), 8 * angle * angle * angle / 6));
    }
}
