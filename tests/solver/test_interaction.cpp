#include "runtime/solver/interaction.h"

#include <tbb/global_control.h>

#include <cmath>
#include <random>

#include "tests/solver/motion/uniform_force.h"
#include "tests/solver/scene.h"
#include "tests/test.h"

using namespace rapid;

namespace {

using test::h;

Dynamics among(double radius, float separation, float cohesion, float alignment, float drag)
{
    auto interaction = std::make_shared<Interaction>();
    interaction->radius = radius;
    interaction->separation = separation;
    interaction->cohesion = cohesion;
    interaction->alignment = alignment;
    interaction->drag = drag;
    return test::chain(interaction);
}

PointSet points_at(std::span<const Vec3f> P, std::span<const Vec3f> v)
{
    return test::points(std::vector<Vec3f>(P.begin(), P.end())).v(std::vector<Vec3f>(v.begin(), v.end()));
}

// Advances a frame like Solve: kick, drift, kick.
void advance(PointSet& points, const Dynamics& interaction, double frame = h)
{
    SolveOptions options;
    options.h = frame;
    interact(points, interaction, options);
    solve(points, {}, options);
    interact(points, interaction, options);
}

PointSet moving_cloud(std::size_t n, float size, float speed)
{
    std::mt19937 random(5);
    std::uniform_real_distribution<float> u(-1, 1);
    std::vector<Vec3f> P(n), v(n);
    for (std::size_t i = 0; i < n; ++i) {
        P[i] = size * Vec3f(u(random), u(random), u(random));
        v[i] = speed * Vec3f(u(random), u(random), u(random));
    }
    PointSet points = points_at(P, v);
    points.set("mass", Column<float>(n, 1.0f));
    const auto mass = points.column<float>("mass").write();
    for (std::size_t i = 0; i < n; ++i) mass[i] = 0.1f + 3 * std::abs(u(random));
    return points;
}

Vec3d momentum(const PointSet& points)
{
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < points.size(); ++i)
        sum += points.column<float>("mass")[i] * points.v()[i].cast<double>();
    return sum;
}

double energy(const PointSet& points)
{
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
        sum += 0.5 * points.column<float>("mass")[i] * points.v()[i].cast<double>().squaredNorm();
    return sum;
}

}  // namespace

TEST_CASE("two passing points approach their mean velocity at twice the rate of alignment", "[interaction]")
{
    const float rate = GENERATE(0.5f, 5.0f, 1e6f);
    // Coincident, so that each has weight 1.
    PointSet points = points_at(std::vector<Vec3f>{{0, 0, 0}, {0, 0, 0}}, std::vector<Vec3f>{{3, 1, 0}, {1, 1, 0}});
    const Dynamics interaction = among(1, 0, 0, rate, 0);
    SolveOptions options;
    options.h = h;
    interact(points, interaction, options);
    CHECK(points.v()[0].x() == Approx(2 + std::exp(-rate * h)));  // half of the frame
    CHECK(points.v()[1].x() == Approx(2 - std::exp(-rate * h)));
    CHECK(points.v()[0].y() == 1);
}

TEST_CASE("drag damps the approach of two points, and not their rotation about each other", "[interaction]")
{
    PointSet points = points_at(std::vector<Vec3f>{{0, 0, 0}, {0.5, 0, 0}}, std::vector<Vec3f>{{1, 2, 0}, {-1, -2, 0}});
    const Dynamics interaction = among(1, 0, 0, 0, 1e6f);
    SolveOptions options;
    options.h = h;
    interact(points, interaction, options);
    // At half a weight, half of it, for any strength; they move along x.
    CHECK(points.v()[0].x() == Approx(0.5));
    CHECK(points.v()[1].x() == Approx(-0.5));
    CHECK(points.v()[0].y() == 2);
}

TEST_CASE("separation is its strength times w, shared by the masses, and limited by the radius", "[interaction]")
{
    const auto apart = [](float strength, double frame) {
        PointSet points = points_at(std::vector<Vec3f>{{0, 0, 0}, {0.25, 0, 0}}, std::vector<Vec3f>(2, Vec3f::Zero()));
        points.set("mass", Column<float>(2, 1.0f));
        points.column<float>("mass").write()[0] = 3;
        advance(points, among(1, strength, 0, 0, 0), frame);
        return points;
    };
    const PointSet weak = apart(0.01f, h);
    const double a = 0.01 * 0.75;
    CHECK(weak.v()[0].x() == Approx(-0.5 * a * h).epsilon(2e-4));  // 2 m_j / (m_i + m_j) = 1/2 and 3/2
    CHECK(weak.v()[1].x() == Approx(1.5 * a * h).epsilon(2e-4));
    const PointSet strong = apart(1e12f, h);
    const double gap = strong.P()[1].x() - strong.P()[0].x();
    CHECK(gap > 0.25);
    CHECK(gap < 1);
}

TEST_CASE("two points that attract each other oscillate about their centre, second order in the frame", "[interaction]")
{
    // There is no closed form: the reference is a run at a thousandth of the step.
    const auto half_gap_after = [](int frames) {
        PointSet points =
            points_at(std::vector<Vec3f>{{-0.3f, 0, 0}, {0.3f, 0, 0}}, std::vector<Vec3f>{{0, 0.3f, 0}, {0, -0.3f, 0}});
        const Dynamics interaction = among(2, 0, 1, 0, 0);
        for (int f = 0; f < frames; ++f) advance(points, interaction, 1.0 / frames);
        return Vec3d(points.P()[1].cast<double>());
    };
    const Vec3d right = half_gap_after(4096);
    const double coarse = (half_gap_after(8) - right).norm(), fine = (half_gap_after(16) - right).norm();
    CHECK(coarse / fine == Approx(4).epsilon(0.1));
}

TEST_CASE("interactions of unequal masses and ages conserve momentum", "[interaction]")
{
    PointSet points = moving_cloud(500, 1, 2);
    points.set("dt", Column<float>(points.size(), float(h)));
    const auto dt = points.column<float>("dt").write();
    for (std::size_t i = 0; i < points.size(); i += 3) dt[i] = static_cast<float>(h * 0.001 * double(i));
    const Vec3d before = momentum(points);
    const Dynamics interaction = among(0.4, 30, 20, 7, 5);
    SolveOptions options;
    options.h = h;
    interact(points, interaction, options);
    // Each velocity is rounded to single precision once.
    CHECK((momentum(points) - before).norm() < 500 * 3 * 4 * 0x1p-24);
}

TEST_CASE("alignment and drag never add energy, at any rate", "[interaction]")
{
    const float rate = GENERATE(1e-3f, 1.0f, 100.0f, 1e9f);
    PointSet points = moving_cloud(300, 0.5f, 2);
    const Dynamics interaction = among(0.6, 0, 0, rate, rate);
    SolveOptions options;
    options.h = h;
    for (int kick = 0; kick < 20; ++kick) {
        const double before = energy(points);
        interact(points, interaction, options);
        CHECK(energy(points) <= before * (1 + 1e-6));
    }
}

TEST_CASE("no strength blows up: a crowd that separates moves no faster than the radius allows",
          "[interaction][extreme][slow]")
{
    const float strength = GENERATE(1.0f, 1e4f, 1e12f);
    PointSet points = moving_cloud(200, 0.2f, 0);
    const Dynamics interaction = among(0.5, strength, strength, 0, 0);
    for (int frame = 0; frame < 200; ++frame) advance(points, interaction);
    for (std::size_t i = 0; i < points.size(); ++i) {
        REQUIRE(points.v()[i].allFinite());
        CHECK(points.v()[i].norm() < 20 * 0.5 / h);
    }
}

TEST_CASE("coincident points separate, each in its own direction", "[interaction][extreme]")
{
    PointSet points = points_at(std::vector<Vec3f>(10, Vec3f(1, 2, 3)), std::vector<Vec3f>(10, Vec3f::Zero()));
    advance(points, among(0.1, 1, 0, 0, 0));
    for (std::size_t i = 0; i < 10; ++i)
        for (std::size_t j = 0; j < i; ++j) CHECK(points.v()[i] != points.v()[j]);
}

TEST_CASE("an interaction has the same bits on any number of threads", "[interaction][threads]")
{
    std::vector<PointSet> results;
    for (const std::size_t threads : {1, 2, 7}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        PointSet points = moving_cloud(20000, 2, 1);
        advance(points, among(0.15, 5, 3, 2, 1));
        results.push_back(points);
    }
    for (std::size_t i = 0; i < results[0].size(); ++i) {
        CHECK(results[0].v()[i] == results[1].v()[i]);
        CHECK(results[0].v()[i] == results[2].v()[i]);
    }
}
