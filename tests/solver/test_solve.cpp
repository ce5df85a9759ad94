// The step without constraints: closed forms at any number of substeps; determinism; wrong input. Covers solve,
// step_context, point_errors, point_block and block_step; coupled_step is covered by constraints/.
#include "runtime/solver/solve.h"

#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>

#include "tests/solver/scene.h"

namespace rapid {
namespace {

using test::close_to;
using test::points;
using test::same_bits;
using test::Scene;

using test::g;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

std::string solve_error(Scene& scene)
{
    try {
        scene.run(1);
        return "";
    } catch (const Error& error) {
        return error.what();
    }
}

TEST_CASE("free fall is exact to rounding, whatever the number of sub-steps", "[solve]")
{
    const int substeps = GENERATE(1, 7, 1000);
    const bool with_collider = GENERATE(false, true);  // forces substeps to be taken
    CAPTURE(substeps, with_collider);
    const int frames = 24;

    Scene scene(points({{1, 10, -2}}).v({{0.5f, 3, 0}}));
    scene.gravity().substeps(substeps);
    if (with_collider) scene.collide(make_plane({0, 1, 0}, -1000));
    scene.run(frames);

    // Once per frame the state is rounded to single precision: by half an ulp of P, and of v, whose error acts for the
    // remaining time, at most 1 s.
    const double ulp_P = 0x1p-20, ulp_v = 0x1p-20;
    CHECK_THAT(scene.P(), close_to(Vec3d(1.5, 10 + 3 - g / 2, -2), frames * (ulp_P + ulp_v) / 2));
    CHECK_THAT(scene.v(), close_to(Vec3d(0.5, 3 - g, 0), frames * ulp_v / 2));
}

TEST_CASE("a newborn point is advanced by its own time", "[solve]")
{
    const bool with_collider = GENERATE(false, true);
    Scene scene(points({{0, 5, 0}, {0, 5, 0}}).v({{1, 0, 0}, {1, 0, 0}}).set<float>("dt", {0.01f, 0}));
    scene.gravity();
    if (with_collider) scene.floor();
    scene.run(1);

    const double t = 0.01f;
    CHECK_THAT(scene.P(0), close_to(Vec3d(t, 5 - g * t * t / 2, 0), 5e-7));
    CHECK_THAT(scene.v(0), close_to(Vec3d(1, -g * t, 0), 1e-7));
    CHECK(scene.P(1) == Vec3d(0, 5, 0));
    CHECK(scene.v(1) == Vec3d(1, 0, 0));
}

TEST_CASE("a point moves by the same bits whether or not others are newborn", "[solve]")
{
    Scene alone(points({{0, 5, 0}}).v({{1, 0, 0}}));
    Scene among(points({{0, 5, 0}, {3, 3, 3}}).v({{1, 0, 0}, {}}).set<float>("dt", {float(1.0 / 24), 0.01f}));
    alone.gravity().run(1);
    among.gravity().run(1);
    CHECK(alone.P(0) == among.P(0));
    CHECK(alone.v(0) == among.v(0));
}

TEST_CASE("a force acts on its group, and on no point where the group is unknown", "[solve]")
{
    Scene scene(points({{0, 0, 0}, {0, 0, 0}}).group("heavy", {1}));
    auto force = std::make_shared<test::UniformForce>(Vec3d(0, -g, 0));
    force->group = GENERATE("heavy", "missing");
    scene.dynamics.add(force);
    scene.frame_length(1).run(1);

    CHECK(scene.P(0) == Vec3d(0, 0, 0));
    const double fallen = force->group == "heavy" ? g / 2 : 0;
    CHECK_THAT(scene.P(1), close_to(Vec3d(0, -fallen, 0), 3e-7));
}

TEST_CASE("only the group of the step is advanced", "[solve]")
{
    Scene scene(points({{0, 0.5f, 0}, {0, 0.5f, 0}, {0, -1, 0}}).group("moving", {1}));
    scene.options.group = "moving";
    scene.gravity().floor(0).frame_length(1).run(1);

    CHECK(scene.P(0) == Vec3d(0, 0.5, 0));
    CHECK(scene.v(0) == Vec3d(0, 0, 0));
    CHECK(scene.P(1) == Vec3d(0, 0, 0));
    CHECK(scene.P(2) == Vec3d(0, -1, 0));
}

TEST_CASE("a force attribute accelerates by force / mass over the point's time, and is cleared", "[solve]")
{
    Scene scene(points({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}})
                    .set<Vec3f>("force", {{0, 6, 0}, {0, 0, 0}, {3, 0, 0}})
                    .set<float>("mass", {2, 0, 1})
                    .set<float>("dt", {1, 1, 0.5f}));
    scene.frame_length(1).run(1);

    CHECK_THAT(scene.P(0), close_to(Vec3d(0, 1.5, 0), 1e-15));
    CHECK_THAT(scene.v(0), close_to(Vec3d(0, 3, 0), 1e-15));
    CHECK(scene.P(1) == Vec3d(1, 0, 0));
    CHECK_THAT(scene.P(2), close_to(Vec3d(2.375, 0, 0), 1e-15));
    for (std::size_t i = 0; i < 3; ++i) CHECK(scene.points.column<Vec3f>("force")[i] == Vec3f(0, 0, 0));
    scene.run(1);
    CHECK_THAT(scene.v(0), close_to(Vec3d(0, 3, 0), 1e-15));
}

TEST_CASE("forces of position are second order: the position in a circular orbit", "[solve]")
{
    const double omega = 2 * std::numbers::pi;  // one revolution per second
    const auto error_after_a_turn = [&](int substeps) {
        Scene scene(points({{1, 0, 0}}).v({{0, float(omega), 0}}));
        scene.force([=](const Chunk& chunk, std::size_t i) { return Vec3d(-omega * omega * chunk.P[i]); });
        scene.substeps(substeps).run(24);
        return (scene.P() - Vec3d(1, 0, 0)).norm();
    };
    const double coarse = error_after_a_turn(2), fine = error_after_a_turn(4);
    CHECK(fine < 5e-3);
    CHECK(std::log2(coarse / fine) == Approx(2).margin(0.15));
}

TEST_CASE("the energy of an orbit stays bounded", "[solve]")
{
    const double omega = 2 * std::numbers::pi;
    Scene scene(points({{1, 0, 0}}).v({{0, float(omega), 0}}));
    scene.force([=](const Chunk& chunk, std::size_t i) { return Vec3d(-omega * omega * chunk.P[i]); });
    double least = 1e9, most = 0;
    for (int f = 0; f < 24000; ++f) {  // 1,000 orbits
        scene.run(1);
        least = std::min(least, scene.P().norm());
        most = std::max(most, scene.P().norm());
    }
    // At 24 steps per revolution the orbit is an ellipse with an error of (ω h)²/8, here 0.9 %, which does not grow.
    CHECK(least > 0.98);
    CHECK(most < 1.02);
}

TEST_CASE("forces are evaluated at the middle of each point's own sub-step", "[solve]")
{
    Scene scene(points({{0, 0, 0}, {0, 0, 0}}).v({{1, 0, 0}, {1, 0, 0}}).set<float>("dt", {1, 0.5f}));
    std::vector<std::array<double, 3>> heard[2];  // time, dt, x of each substep
    scene.force([&](const Chunk& chunk, std::size_t i) {
        heard[i].push_back({chunk.time[i], chunk.dt[i], chunk.P[i].x()});
        return Vec3d(0, 0, 0);
    });
    scene.frame_length(1).substeps(2).run(1);

    using Reported = std::vector<std::array<double, 3>>;
    CHECK(heard[0] == Reported{{0.25, 0.5, 0.25}, {0.75, 0.5, 0.75}});
    CHECK(heard[1] == Reported{{0.625, 0.25, 0.125}, {0.875, 0.25, 0.375}});
}

TEST_CASE("sets of no, one and two points are advanced", "[solve][extreme]")
{
    const std::size_t n = GENERATE(0, 1, 2);
    Scene scene{PointSet(points(std::vector<Vec3f>(n, Vec3f(0, 1, 0))))};
    scene.gravity().floor().run(40);
    CHECK(scene.points.size() == n);
    for (std::size_t i = 0; i < n; ++i) CHECK(scene.P(i) == Vec3d(0, 0, 0));
}

TEST_CASE("a point that is not finite stops the step, and is named", "[solve]")
{
    const bool with_collider = GENERATE(false, true);
    const auto [bad, text] = GENERATE(table<float, std::string>({{nan, "nan"}, {infinity, "inf"}}));
    std::vector<Vec3f> velocities(5000, Vec3f::Zero());
    velocities[4500] = {0, bad, 1};
    velocities[4900] = {bad, 0, 0};
    Scene scene(points(std::vector<Vec3f>(5000, Vec3f(0, 1, 0))).v(velocities));
    if (with_collider) scene.floor();
    scene.options.frame = 30;

    CHECK(solve_error(scene) ==
          "point 4500, frame 31: v is {0, " + text +
              ", 1} before the step; correct the node before this one; it has P = {0, 1, 0}, v = {0, " + text + ", 1}");
}

TEST_CASE("points at rest on which nothing acts stay, without a write", "[solve]")
{
    std::vector<Vec3f> positions(5000, Vec3f(1, 2, 3));
    Scene scene(points(positions));
    const Vec3f* const before = scene.points.P().read().data;
    scene.run(3);
    CHECK(scene.points.P().read().data == before);
    CHECK(scene.points.v().read().stride == 0);
    CHECK(same_bits(scene.points, points(positions)));

    SECTION("but a position that is not finite is told")
    {
        positions[4500] = {1, nan, 3};
        scene.points = points(positions);
        CHECK(solve_error(scene) ==
              "point 4500, frame 4: P is {1, nan, 3} before the step; correct the node before this one; it has P = "
              "{1, nan, 3}, v = {0, 0, 0}");
    }
    SECTION("and a force moves them")
    {
        const float newtons = GENERATE(24.0f, 24e-6f, 24e-30f);
        scene.points.add({"force", Vec3f(0, newtons, 0)});
        scene.run(1);
        CHECK(scene.points.v()[4500].y() == Approx(newtons / 24));
        CHECK(scene.points.column<Vec3f>("force")[4500] == Vec3f::Zero());
    }
}

TEST_CASE("a velocity that becomes infinite in the step stops it, and is named", "[solve]")
{
    Scene scene(points({{0, 0, 0}, {0, 0, 0}}).v({{0, 0, 0}, {3e38f, 0, 0}}));
    scene.gravity({3e38, 0, 0}).frame_length(1);
    CHECK(solve_error(scene) ==
          "point 1, frame 1: P became {inf, 0, 0} in the step; the frame was not written; it has P = {inf, 0, 0}, v = "
          "{inf, 0, 0}");
}

TEST_CASE("a point that becomes infinite in the step is named with the values it had before", "[solve]")
{
    Scene scene(points({{0, 0, 0}, {5, 0, 0}}).v({{0, 0, 0}, {0, 2, 0}}).set<float>("heat", {1, 7}).group("hot", {1}));
    scene.force(
        [](const Chunk& chunk, std::size_t i) { return chunk.P[i].x() > 1 ? Vec3d(0, 1e300, 0) : Vec3d(0, 0, 0); });
    scene.options.substeps = 3;
    CHECK(
        solve_error(scene) ==
        "point 1, frame 1: P became {5, inf, 0} in the step; the frame was not written; it had P = {5, 0, 0}, v = {0, "
        "2, 0}, heat = 7, in \"hot\"");
}

TEST_CASE("a force that is not finite is named, with the point", "[solve]")
{
    Scene scene(points({{0, 0, 0}, {1, 0, 0}}));
    scene.force([](const Chunk& chunk, std::size_t i) { return Vec3d(1 / (chunk.P[i].x() - 1), 0, 0); });
    CHECK(
        solve_error(scene) ==
        "node \"push1\": point 1, frame 1: its acceleration became {inf, 0, 0}; the frame was not written; it had P = "
        "{1, 0, 0}, v = {0, 0, 0}");
}

TEST_CASE("a force needs a mass above 0", "[solve]")
{
    Scene scene(points({{0, 0, 0}}).set<Vec3f>("force", {{1, 0, 0}}).set<float>("mass", {0}));
    CHECK(solve_error(scene) ==
          "point 0, frame 1: a force of {1, 0, 0} on a mass of 0; the force must be finite and the mass above 0");
}

TEST_CASE("a collider whose attribute is missing is named", "[solve]")
{
    Scene scene(points({{0, 1, 0}}).set<float>("bouncy", {0.5f}));
    scene.collide(make_plane({0, 1, 0}, 0), PerPoint<float>::of("bounzy"));
    CHECK(solve_error(scene) == "node \"collide1\": no attribute \"bounzy\"; did you mean \"bouncy\"?");
}

// Points throughout a scene with a floor, a ball and a box, some of them newborn.
Scene crowd(std::size_t n, std::size_t before)
{
    std::mt19937 random(5);
    std::uniform_real_distribution<float> place(-2, 2), speed(-5, 5), radius(0, 0.1f), time(0, 1.0f / 24);
    std::vector<Vec3f> P(before, Vec3f(0.1f, 3, 0.2f)), v(before, Vec3f(1, -30, 0));
    std::vector<float> pscale(before, 0.3f), dt(before, 0.02f), bounce(before, 1.0f);
    for (std::size_t i = 0; i < n; ++i) {
        P.emplace_back(place(random), 2 + place(random), place(random));
        v.emplace_back(speed(random), speed(random), speed(random));
        pscale.push_back(radius(random));
        dt.push_back(i % 3 == 0 ? time(random) : float(1.0 / 24));
        bounce.push_back(radius(random) * 10);
    }
    Scene scene(points(P).v(v).set<float>("pscale", pscale).set<float>("dt", dt).set<float>("bounce", bounce));
    scene.gravity()
        .collide(make_plane({0.1, 1, 0}, 0), 0.5f, 0.2f)
        .collide(make_sphere_shape(0.7, {0.5, 0.5, 0}), PerPoint<float>::of("bounce"))
        .collide(make_box_shape({1, 1, 1}, {-0.7, 0.3, 0}), 0.3f, 0.4f)
        .substeps(2);
    return scene;
}

// Returns the last n values.
template <class T>
Column<T> last_of(const Column<T>& column, std::size_t n)
{
    REQUIRE(column.size() >= n);
    return Column<T>(std::span(column.read().data + column.size() - n, n));
}

TEST_CASE("results are the same bits on any number of threads", "[solve][threads]")
{
    Scene reference = crowd(20000, 0);
    {
        const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
        reference.run(12);
    }
    const std::size_t threads = GENERATE(2, 7);
    const tbb::global_control several(tbb::global_control::max_allowed_parallelism, threads);
    Scene scene = crowd(20000, 0);
    scene.run(12);

    CHECK(same_bits(reference.points, scene.points));
    CHECK(reference.collisions == scene.collisions);
    CHECK(reference.penetration_max == scene.penetration_max);
}

TEST_CASE("results are the same bits at any place in the set, and whichever other points there are", "[solve]")
{
    const std::size_t before = GENERATE(1, 100, 4096, 5000);
    Scene alone = crowd(3000, 0), among = crowd(3000, before);
    alone.run(12);
    among.run(12);

    CHECK(same_bits(alone.points.P(), last_of(among.points.P(), 3000)));
    CHECK(same_bits(alone.points.v(), last_of(among.points.v(), 3000)));
}

TEST_CASE("of the parts of a frame, counts add up, and later figures of its end replace earlier ones", "[solve]")
{
    FrameFigures first, second;
    first.born = 3, first.collisions = 2, first.substeps = 4, first.trapped = 5, first.constraint_rows = 7;
    first.error.values = {1, 2};
    first.contact_grids.emplace();
    first.bands = {{"a", 1, 1, 0.5}, {"b", 1, 1, 0.25}};
    second.born = 1, second.substeps = 2, second.trapped = 2, second.constraint_rows = 6, second.error.values = {3};
    second.bands = {{"b", 2, 2, 0.5}};
    first.append(second);
    CHECK(first.born == 4);
    CHECK(first.collisions == 2);
    CHECK(first.substeps == 4);
    CHECK(first.trapped == 5);
    CHECK(first.constraint_rows == 6);
    CHECK(first.error.values == std::vector<double>{3});
    CHECK(!first.contact_grids);
    REQUIRE(first.bands.size() == 2);
    CHECK((first.bands[0].node == "b" && first.bands[0].seconds == 0.75 && first.bands[0].width == 2));
    CHECK(first.bands[1].node == "a");
}

TEST_CASE("of points that are advanced side by side, counts add up, and the largest error stays", "[solve]")
{
    FrameFigures all, chunk;
    all.trapped = 5, all.constraint_rows = 7, all.penetration_max = 0.25, all.rounding = 0.5;
    all.error.values = {1, 2}, all.energy_drift.values = {1};
    all.contact_grids.emplace().search_seconds = 1;
    chunk.trapped = 2, chunk.constraint_rows = 6, chunk.penetration_max = 0.5, chunk.rounding = 0.25;
    chunk.error.values = {3}, chunk.energy_drift.is_defined = false;
    all.add(chunk);
    CHECK(all.trapped == 7);
    CHECK(all.constraint_rows == 13);
    CHECK(all.penetration_max == 0.5);
    CHECK(all.rounding == 0.5);
    CHECK(all.error.values == std::vector<double>{1, 2, 3});
    CHECK(all.contact_grids->search_seconds == 1);
    all.energy_drift.summarise();
    CHECK(!all.energy_drift.summary);  // not defined for all points
}

}  // namespace
}  // namespace rapid
