// Points that turn, compared with closed forms of solid spheres: sliding that becomes rolling, slopes, rolling
// friction, impacts; momentum, angular momentum and energy.
#include "runtime/solver/constraints/spin.h"

#include <tbb/global_control.h>

#include <cmath>
#include <random>

#include "tests/solver/constraints/granular.h"

namespace rapid {
namespace {

using test::close_to;
using test::Granular;
using test::points;
using test::same_bits;

using test::g;

class Spinning : public Granular {
public:
    explicit Spinning(PointSet set, float bounce = 0, float friction = 0, float rolling = 0)
        : Granular(std::move(set), bounce, friction)
    {
        spheres->options.spin = true;
        spheres->options.rolling = rolling;
        if (!points.has("w")) points.add({"w", Vec3f(Vec3f::Zero())});
        points.add({"orient", Quatf(Quatf::Identity())});
    }

    Vec3d w(std::size_t i = 0) const { return (*points.find<Vec3f>("w"))[i].cast<double>(); }
    double mass(std::size_t i) const { return points.find<float>("mass") ? (*points.find<float>("mass"))[i] : 1; }
    double radius(std::size_t i) const { return (*points.find<float>("pscale"))[i]; }
    double inertia(std::size_t i) const { return 0.4 * mass(i) * radius(i) * radius(i); }
    template <class F>
    auto sum(F f) const
    {
        auto total = f(0);
        for (std::size_t i = 1; i < points.size(); ++i) total += f(i);
        return total;
    }
    Vec3d angular_momentum() const
    {
        return sum([&](std::size_t i) { return Vec3d(mass(i) * P(i).cross(v(i)) + inertia(i) * w(i)); });
    }
    // Optionally includes gravity.
    double energy(double gravity = 0) const
    {
        return sum([&](std::size_t i) {
            return 0.5 * mass(i) * v(i).squaredNorm() + 0.5 * inertia(i) * w(i).squaredNorm() +
                   mass(i) * gravity * P(i).y();
        });
    }
};

TEST_CASE("a sphere that slides is rolling at 2 v / (7 mu g), at 5/7 of its speed", "[spin]")
{
    const int substeps = GENERATE(1, 4, 16);
    CAPTURE(substeps);
    const double r = 0.1, v0 = 3, mu = 0.25, stop = 2 * v0 / (7 * mu * g);
    Spinning scene(points({{0, 0.1f, 0}}).v({{3, 0, 0}}).set<float>("pscale", {0.1f}));
    scene.gravity().floor(0, 0.25f).substeps(substeps);
    const int sliding = static_cast<int>(stop * 24);
    scene.run(sliding);
    double t = sliding / 24.0;
    CHECK_THAT(scene.v(), close_to(Vec3d(v0 - mu * g * t, 0, 0), 1e-5));
    CHECK_THAT(scene.w(), close_to(Vec3d(0, 0, -2.5 * mu * g * t / r), 1e-3));
    CHECK(scene.P().x() == Approx(v0 * t - 0.5 * mu * g * t * t).margin(1e-5));
    scene.run(24);
    t += 1;
    const double rolled = v0 * stop - 0.5 * mu * g * stop * stop + 5.0 / 7 * v0 * (t - stop);
    CHECK_THAT(scene.v(), close_to(Vec3d(5.0 / 7 * v0, 0, 0), 1e-5));
    CHECK_THAT(scene.w(), close_to(Vec3d(0, 0, -5.0 / 7 * v0 / r), 1e-3));
    CHECK(scene.P().x() == Approx(rolled).margin(0.5 * mu * g / (24.0 * 24 * substeps * substeps)));
}

TEST_CASE("a sphere rolls down a slope at 5/7 g sin, and slides where friction is below 2/7 tan", "[spin]")
{
    const double angle = GENERATE(0.1, 0.5, 0.9);
    const int substeps = GENERATE(1, 8);
    CAPTURE(angle, substeps);
    const float limit = static_cast<float>(2.0 / 7 * std::tan(angle));
    const Vec3d n(std::sin(angle), std::cos(angle), 0), down(std::cos(angle), -std::sin(angle), 0);
    for (const float mu : {1.5f * limit, 0.5f * limit}) {
        Spinning scene(points({Vec3f((0.1 * n).cast<float>())}).set<float>("pscale", {0.1f}));
        scene.gravity().collide(make_plane(n, 0), 0.0f, mu).substeps(substeps).run(24);
        const double a = mu > limit ? 5.0 / 7 * g * std::sin(angle) : g * (std::sin(angle) - mu * std::cos(angle));
        const double turning = mu > limit ? a / 0.1 : 2.5 * mu * g * std::cos(angle) / 0.1;
        CHECK_THAT(scene.v(), close_to(Vec3d(a * down), 2e-5));
        CHECK_THAT(scene.P(), close_to(Vec3d(0.5 * a * down + 0.1 * n), 2e-5));
        CHECK_THAT(scene.w(), close_to(Vec3d(0, 0, -turning), 1e-3));
    }
}

TEST_CASE("rolling friction stops a ball after 7 v^2 / (10 mu g)", "[spin]")
{
    const double v = 1, rolling = 0.05;
    Spinning scene(
        points({{0, 0.1f, 0}}).v({{1, 0, 0}}).set<float>("pscale", {0.1f}).set<Vec3f>("w", {Vec3f(0, 0, -10)}), 0, 0,
        static_cast<float>(rolling));
    scene.gravity().floor(0, 0.5f).substeps(16).run(96);
    CHECK(scene.P().x() == Approx(7 * v * v / (10 * rolling * g)).epsilon(0.005));
    CHECK(scene.v().norm() < 1e-4);
    CHECK(scene.w().norm() < 1e-3);
}

TEST_CASE("rolling friction holds a ball on slopes below it, and no others", "[spin]")
{
    const double angle = 0.2;
    const Vec3d n(std::sin(angle), std::cos(angle), 0);
    for (const bool holds : {true, false}) {
        const double rolling = (holds ? 1.3 : 0.7) * std::tan(angle);
        Spinning scene(points({Vec3f((0.1 * n).cast<float>())}).set<float>("pscale", {0.1f}), 0, 0,
                       static_cast<float>(rolling));
        scene.gravity().collide(make_plane(n, 0), 0.0f, 0.8f).substeps(8).run(48);
        const double a = 5.0 / 7 * g * (std::sin(angle) - rolling * std::cos(angle));
        if (holds)
            CHECK(scene.v().norm() < 1e-3);
        else
            CHECK(scene.v().norm() == Approx(2 * a).epsilon(0.01));
    }
}

TEST_CASE("a ball that is dropped with spin leaves the floor by 2/7 of its surface's speed", "[spin]")
{
    const double s = 4, r = 0.1;
    Spinning scene(
        points({{0, 1, 0}}).set<float>("pscale", {0.1f}).set<Vec3f>("w", {Vec3f(0, 0, static_cast<float>(-s / r))}), 0,
        0);
    scene.gravity().floor(0.5f, 2).substeps(GENERATE(1, 5)).run(15);
    CHECK(scene.v().x() == Approx(2.0 / 7 * s).epsilon(1e-5));
    CHECK(scene.w().z() == Approx(-2.0 / 7 * s / r).epsilon(1e-5));
}

TEST_CASE("an oblique impact keeps momentum and angular momentum, stops the sliding, and adds no energy", "[spin]")
{
    const float bounce = GENERATE(0.0f, 0.4f, 1.0f), mu = GENERATE(0.1f, 5.0f);
    const int substeps = GENERATE(1, 4);
    CAPTURE(bounce, mu, substeps);
    Spinning scene(points({{-0.31f, 0.05f, 0}, {0.2f, 0, 0.02f}})
                       .v({{8, 1, -1}, {-2, 0.5f, 0}})
                       .set<float>("pscale", {0.1f, 0.2f})
                       .set<float>("mass", {1, 3})
                       .set<Vec3f>("w", {Vec3f(3, -7, 20), Vec3f(1, 2, -3)}),
                   bounce, mu);
    const Vec3d momentum = scene.momentum(), angular = scene.angular_momentum();
    const double energy = scene.energy();
    scene.substeps(substeps).run(3);
    CHECK((scene.v(0) - Vec3d(8, 1, -1)).norm() > 1);
    CHECK_THAT(scene.momentum(), close_to(momentum, 1e-5));
    CHECK_THAT(scene.angular_momentum(), close_to(angular, 5e-6));
    CHECK(scene.energy() < energy * (1 - 1e-4));
}

TEST_CASE("friction that sticks leaves the surfaces of two spheres at one speed", "[spin]")
{
    Spinning scene(points({{-0.15f, 0, 0}, {0.15f, 0, 0}}).v({{4, 2, 0}, {0, 0, 0}}).set<float>("pscale", {0.1f, 0.1f}),
                   1, 10);
    scene.substeps(1).run(1);
    // Their centers touch in the direction n, at d - u s with |d - u s| = 0.2.
    const double s = (4 * 0.3 - std::sqrt(16 * 0.09 - 20 * (0.09 - 0.04))) / 20;
    const Vec3d n = Vec3d(-0.3 + 4 * s, 2 * s, 0) / 0.2, u(4, 2, 0), along = u - u.dot(n) * n;
    const Vec3d impulse = -u.dot(n) * n - along / 7;  // effective masses 1/2 and 1/7
    CHECK_THAT(scene.v(0), close_to(Vec3d(u + impulse), 2e-6));
    CHECK_THAT(scene.v(1), close_to(Vec3d(-impulse), 2e-6));
    for (const std::size_t i : {0, 1}) CHECK_THAT(scene.w(i), close_to(Vec3d(2.5 / 0.1 * n.cross(along) / 7), 2e-5));
}

TEST_CASE("an impact that rounding leaves without a closing speed, and that does not slide, changes nothing", "[spin]")
{
    Spin spin{Vec3d::Zero(), 2.5, 0.1, 0};
    const Vec3d n(0, 1, 0), impulse = spinning_impact(spin, 2.0, n, 1e-17 * n, 0.5, 1.0);
    CHECK(impulse.norm() < 1e-16);
    CHECK(spin.s.isZero(0));
}

TEST_CASE("what turns freely turns by exp(w t)", "[spin]")
{
    const Vec3d w(3, -4, 12);
    Spinning scene(points({{0, 0, 0}}).set<float>("pscale", {0.1f}).set<Vec3f>("w", {Vec3f(w.cast<float>())}));
    scene.substeps(3).run(24);
    const Eigen::Quaterniond turned(Eigen::AngleAxisd(w.norm(), w.normalized()));
    const Quatf orient = (*scene.points.find<Quatf>("orient"))[0];
    CHECK(std::abs(turned.dot(orient.cast<double>())) == Approx(1).epsilon(1e-6));
    CHECK_THAT(scene.w(), close_to(w, 1e-5));
}

Spinning cloud(std::size_t n, std::uint32_t seed, float bounce, float friction, float rolling)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> in(-1, 1);
    std::vector<Vec3f> at, v, w;
    std::vector<float> mass, radius;
    for (std::size_t k = 0; k < n; ++k) {
        at.emplace_back(0.3f * static_cast<float>(k % 4), 0.3f * static_cast<float>(k / 16) + 0.2f,
                        0.3f * static_cast<float>(k / 4 % 4));
        v.emplace_back(Vec3f(0.6f, 1, 0.6f) - 2 * at.back() + Vec3f(in(random), in(random), in(random)));
        w.emplace_back(20 * Vec3f(in(random), in(random), in(random)));
        radius.push_back(0.1f + 0.04f * in(random));
        mass.push_back(std::pow(2.0f, 2 * in(random)));
    }
    return Spinning(points(at).v(v).set<float>("mass", mass).set<float>("pscale", radius).set<Vec3f>("w", w), bounce,
                    friction, rolling);
}

TEST_CASE("a cloud of spinning grains keeps its momenta, and gains no energy", "[spin]")
{
    const auto [bounce, friction, rolling] = GENERATE(std::array{0.0f, 0.5f, 0.0f}, std::array{0.6f, 0.3f, 0.1f},
                                                      std::array{1.0f, 1.0f, 0.0f}, std::array{0.9f, 0.0f, 0.0f});
    CAPTURE(bounce, friction, rolling);
    Spinning scene = cloud(48, 7, bounce, friction, rolling);
    const Vec3d momentum = scene.momentum(), angular = scene.angular_momentum();
    double energy = scene.energy();
    const double scale = scene.sum([&](std::size_t i) { return scene.mass(i) * scene.v(i).norm(); });
    scene.substeps(8);
    for (int frame = 0; frame < 48; ++frame) {
        scene.run(1);
        CHECK(scene.energy() <= energy * (1 + 1e-6));
        energy = scene.energy();
    }
    CHECK((scene.momentum() - momentum).norm() < 1e-5 * scale);
    // Impacts conserve it; recovering an overlap moves grains that pass each other.
    CHECK((scene.angular_momentum() - angular).norm() < 1e-4 * scale);
}

TEST_CASE("a heap of spinning grains gains no energy, and comes to rest", "[spin]")
{
    Spinning scene = cloud(64, 3, 0.2f, 0.5f, 0.1f);
    scene.gravity().floor(0.2f, 0.5f).substeps(12).sleep();
    double energy = scene.energy(g);
    for (int frame = 0; frame < 240; ++frame) {
        scene.run(1);
        CHECK(scene.energy(g) <= energy + 2e-5 * 64 * g);
        energy = scene.energy(g);
    }
    CHECK(scene.last.asleep == 64);
    for (std::size_t i = 0; i < 64; ++i) CHECK(scene.w(i).isZero(0));
}

TEST_CASE("a point that turns in place does not sleep", "[spin]")
{
    Spinning scene(points({{0, 0.1f, 0}}).set<float>("pscale", {0.1f}).set<Vec3f>("w", {Vec3f(0, 5, 0)}));
    scene.gravity().floor(0, 0.5f).substeps(4).sleep().run(48);
    CHECK(scene.last.asleep == 0);
    CHECK_THAT(scene.w(), close_to(Vec3d(0, 5, 0), 1e-4));
}

TEST_CASE("spinning grains have the same bits on any number of threads", "[spin]")
{
    const auto run = [](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        Spinning scene = cloud(600, 5, 0.3f, 0.5f, 0.05f);
        scene.gravity().floor(0.3f, 0.5f).substeps(6).run(12);
        return scene.points;
    };
    const PointSet one = run(1), two = run(2);
    CHECK(same_bits(one, two));
    CHECK(same_bits(one.column<Vec3f>("w"), two.column<Vec3f>("w")));
}

}  // namespace
}  // namespace rapid
