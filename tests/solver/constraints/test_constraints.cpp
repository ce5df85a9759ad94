// Rows that are solved from their residual and gradient: closed forms of rods, springs and chains; momentum;
// bit-identical results on any number of threads.
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

#include "tests/solver/constraints/rods.h"
#include "tests/solver/scene.h"

namespace rapid {
namespace {

using test::close_to;
using test::immovable;
using test::links_of_chain;
using test::points;
using test::rods;
using test::Scene;

using test::g;

// A chain of n links that hangs straight down from an immovable point.
Scene chain(std::size_t n, double link, double compliance, float mass = 1)
{
    std::vector<Vec3f> at;
    std::vector<float> masses(n + 1, mass);
    masses[0] = immovable;
    for (std::size_t k = 0; k <= n; ++k)
        at.emplace_back(0.0f, static_cast<float>(-link * static_cast<double>(k)), 0.0f);
    Scene scene(points(at).set<float>("mass", masses));
    scene.gravity();
    scene.dynamics.add(rods(links_of_chain(static_cast<std::int64_t>(n)), link, compliance));
    return scene;
}

void come_to_rest(Scene& scene, int frames)
{
    for (int f = 0; f < frames; ++f) {
        scene.run(1);
        for (Vec3f& v : scene.points.v().write()) v *= 0.8f;
    }
}

// Returns K(k), by the arithmetic-geometric mean.
double complete_elliptic(double k)
{
    double a = 1, b = std::sqrt(1 - k * k);
    for (int step = 0; step < 40; ++step) {
        const double mean = (a + b) / 2;
        b = std::sqrt(a * b);
        a = mean;
    }
    return std::numbers::pi / (2 * a);
}

// Returns the time of the n-th passage through the lowest position, interpolated between frames.
double time_of_passage(Scene& scene, int n)
{
    double before = scene.P(1).x();
    int passed = 0;
    while (true) {
        scene.run(1);
        const double x = scene.P(1).x();
        if ((x > 0) != (before > 0) && ++passed == n)
            return (static_cast<double>(scene.options.frame) - x / (x - before)) * scene.options.h;
        before = x;
        REQUIRE(scene.options.frame < 2000);
    }
}

TEST_CASE("a pendulum has the period of the closed form, to second order, and keeps its length", "[constraints]")
{
    const double length = 1, angle = std::numbers::pi / 3;
    const double period = 4 * std::sqrt(length / g) * complete_elliptic(std::sin(angle / 2));
    const auto error_with = [&](int substeps) {
        Scene scene(points({{0, 0, 0}, {static_cast<float>(std::sin(angle)), static_cast<float>(-std::cos(angle)), 0}})
                        .set<float>("mass", {immovable, 1}));
        scene.gravity().substeps(substeps).frame_length(1.0 / 96);
        scene.dynamics.add(rods({{0, 1}}, length));
        const double time = time_of_passage(scene, 9);  // a quarter, and four periods
        CHECK(scene.P(1).norm() == Approx(length).margin(1e-4));
        return std::abs(time - 4.25 * period);
    };
    const double coarse = error_with(2), fine = error_with(4);
    CAPTURE(coarse, fine);
    CHECK(coarse < 1e-3);
    CHECK(coarse / fine > 3.5);  // 4 for an error of second order
}

TEST_CASE("a spring is stretched by its load, whatever the steps and iterations", "[constraints]")
{
    const double compliance = GENERATE(1e-4, 1e-2);
    const int substeps = GENERATE(1, 3, 40), iterations = GENERATE(1, 5);
    CAPTURE(compliance, substeps, iterations);
    const double mass = 2, stretch = compliance * mass * g;
    Scene scene(points({{0, 0, 0}, {0, static_cast<float>(-1 - stretch), 0}}).set<float>("mass", {immovable, 2}));
    scene.gravity().substeps(substeps);
    scene.options.iterations = iterations;
    scene.dynamics.add(rods({{0, 1}}, 1, compliance));
    come_to_rest(scene, 240);
    // Tolerance: rounding of P and v once per frame.
    CHECK(-scene.P(1).y() == Approx(1 + stretch).margin(2e-6));
    CHECK(scene.v(1).norm() < 1e-5);
}

TEST_CASE("a chain hangs in its closed form, independent of sub-steps and iterations", "[constraints]")
{
    const int substeps = GENERATE(1, 8), iterations = GENERATE(1, 4);
    CAPTURE(substeps, iterations);
    const std::size_t n = 20;
    const double link = 0.1, compliance = 1e-4, mass = 0.5;
    Scene scene = chain(n, link, compliance, mass);
    scene.substeps(substeps);
    scene.options.iterations = iterations;
    come_to_rest(scene, 400);
    for (std::size_t k = 1; k <= n; ++k) {
        const double load = mass * g * static_cast<double>(n + 1 - k);
        CHECK(scene.P(k - 1).y() - scene.P(k).y() == Approx(link + compliance * load).margin(2e-5));
    }
}

TEST_CASE("a chain of 1,000 links hangs, and swings, with a strain below 1 %", "[constraints][slow]")
{
    Scene scene = chain(1000, 0.1, 0);
    const auto P = scene.points.P().write();
    const bool swings = GENERATE(false, true);
    if (swings)
        for (std::size_t k = 0; k <= 1000; ++k) P[k] = Vec3f(0.1f * static_cast<float>(k), 0, 0);
    scene.substeps(4);
    double worst = 0;
    for (int f = 0; f < 96; ++f) {
        scene.run(1);
        for (std::size_t k = 1; k <= 1000; ++k)
            worst = std::max(worst, std::abs((scene.P(k) - scene.P(k - 1)).norm() / 0.1 - 1));
    }
    CAPTURE(swings);
    CHECK(worst < 0.01);
}

TEST_CASE("rods keep the momentum, and a dumbbell its angular momentum to second order", "[constraints]")
{
    const auto lost_with = [&](int substeps) {
        Scene scene(points({{-0.5f, 0, 0}, {0.5f, 0, 0}}).v({{0, -3, 1}, {0, 1, 1}}).set<float>("mass", {1, 3}));
        scene.substeps(substeps).frame_length(1.0 / 24);
        scene.dynamics.add(rods({{0, 1}}, 1));
        const auto momentum = [&] { return Vec3d(scene.v(0) + 3 * scene.v(1)); };
        const auto spin = [&] { return Vec3d(scene.P(0).cross(scene.v(0)) + 3 * scene.P(1).cross(scene.v(1))); };
        const Vec3d p = momentum(), L = spin();
        scene.run(48);
        CHECK_THAT(momentum(), close_to(p, 48 * 1e-6));
        return (spin() - L).norm() / L.norm();
    };
    const double coarse = lost_with(4), fine = lost_with(8);
    CAPTURE(coarse, fine);
    CHECK(coarse < 0.02);
    CHECK((fine < 2e-6 || coarse / fine > 3));
}

TEST_CASE("a net, which is no tree, has the same bits on any number of threads", "[constraints][threads][slow]")
{
    constexpr std::int64_t side = 60;
    const auto hang = [&](int threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                        static_cast<std::size_t>(threads));
        std::vector<Vec3f> at;
        std::vector<float> masses;
        std::vector<std::array<std::int64_t, 2>> pairs;
        for (std::int64_t i = 0; i < side; ++i)
            for (std::int64_t j = 0; j < side; ++j) {
                at.emplace_back(0.1f * static_cast<float>(i), 0.0f, 0.1f * static_cast<float>(j));
                masses.push_back(i == 0 ? immovable : 1.0f);
                if (i > 0) pairs.push_back({(i - 1) * side + j, i * side + j});
                if (j > 0) pairs.push_back({i * side + j - 1, i * side + j});
            }
        Scene scene(points(at).set<float>("mass", masses));
        scene.gravity().substeps(4).floor();
        scene.dynamics.add(rods(pairs, 0.1));
        scene.run(6);
        CHECK(scene.last.constraint_rows == pairs.size());
        return scene.points;
    };
    const PointSet one = hang(1), four = hang(4);
    CHECK(std::memcmp(one.P().read().data, four.P().read().data, one.size() * sizeof(Vec3f)) == 0);
    CHECK(std::memcmp(one.v().read().data, four.v().read().data, one.size() * sizeof(Vec3f)) == 0);
}

TEST_CASE("drag does not change how far a load stretches a spring", "[constraints]")
{
    class Drag : public Force {
        void contribute(const Chunk& chunk, Forces& forces) const override
        {
            for (std::size_t i = 0; i < chunk.size(); ++i) forces.add_drag(i, 30, Vec3d::Zero());
        }
    };
    const double compliance = 1e-2;
    Scene scene(points({{0, 0, 0}, {0, -1, 0}}).set<float>("mass", {immovable, 2}));
    scene.gravity();
    scene.dynamics.add(std::make_shared<Drag>());
    scene.dynamics.add(rods({{0, 1}}, 1, compliance));
    scene.run(480);
    CHECK(-scene.P(1).y() == Approx(1 + compliance * 2 * g).margin(2e-6));
}

TEST_CASE("a point that a rod pushes into the ground lies on it", "[constraints]")
{
    // A rod that stands on the ground: the ground supports both.
    Scene scene(points({{0, 0.1f, 0}, {0, 1.1f, 0}}).set<float>("mass", {1, 2}).set<float>("pscale", {0.1f, 0.1f}));
    scene.gravity().floor(0).substeps(4);
    scene.options.iterations = 20;
    scene.dynamics.add(rods({{0, 1}}, 1));
    scene.run(48);
    CHECK(scene.P(0).y() >= 0.1f);
    CHECK_THAT(scene.P(0), close_to(Vec3d(0, 0.1, 0), 1e-6));
    CHECK_THAT(scene.P(1), close_to(Vec3d(0, 1.1, 0), 1e-5));
    CHECK(scene.v(1).norm() < 1e-4);
    CHECK(scene.penetration_max < 1e-6);
}

TEST_CASE("a mass of 0 is refused, with the point", "[constraints]")
{
    Scene scene(points({{0, 0, 0}, {0, -1, 0}}).set<float>("mass", {0, 1}));
    scene.dynamics.add(rods({{0, 1}}, 1));
    std::string text;
    try {
        scene.run(1);
    } catch (const Error& error) {
        text = error.what();
    }
    CHECK(text ==
          "point 0, frame 1: its mass is 0; with constraints it must be above 0 (:pin is for a point that they do "
          "not move)");
}

}  // namespace
}  // namespace rapid
