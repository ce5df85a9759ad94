// Recorded contact forces against statics and the momentum of impacts.
#include "runtime/solver/constraints/contact_forces.h"

#include <cmath>

#include "tests/solver/constraints/granular.h"
#include "tests/solver/constraints/rods.h"

namespace rapid {
namespace {

using test::Granular;
using test::points;
using test::same_bits;
using test::Scene;

using test::g;

void record(Granular& scene)
{
    scene.spheres->options.record = true;
    for (const char* name : {"normalforce", "frictionforce"}) scene.points.add({name, 0.0f});
    scene.points.add({"contactnum", std::int32_t{0}});
}

double normal(const Scene& scene, std::size_t i = 0) { return (*scene.points.find<float>("normalforce"))[i]; }
double friction(const Scene& scene, std::size_t i = 0) { return (*scene.points.find<float>("frictionforce"))[i]; }
int contacts(const Scene& scene, std::size_t i = 0) { return (*scene.points.find<std::int32_t>("contactnum"))[i]; }

PointSet column(std::size_t n, float r, float mass)
{
    std::vector<Vec3f> at;
    for (std::size_t k = 0; k < n; ++k) at.emplace_back(0.0f, r * static_cast<float>(2 * k + 1), 0.0f);
    return points(at).set<float>("pscale", std::vector<float>(n, r)).set<float>("mass", std::vector<float>(n, mass));
}

TEST_CASE("the k-th grain of a column from its top carries (2k - 1) m g in two contacts", "[contact_forces]")
{
    const std::size_t n = 8;
    const double mass = 0.3;
    Granular scene(column(n, 0.02f, static_cast<float>(mass)), 0, 0.5f);
    record(scene);
    scene.gravity().floor(0, 0.5f).substeps(16).run(120);
    for (std::size_t k = 1; k <= n; ++k) {
        CAPTURE(k);
        const std::size_t i = n - k;
        CHECK(normal(scene, i) == Approx((2.0 * static_cast<double>(k) - 1) * mass * g).epsilon(2e-3));
        CHECK(friction(scene, i) == Approx(0).margin(1e-3 * mass * g));
        CHECK(contacts(scene, i) == (k == 1 ? 1 : 2));
    }
}

TEST_CASE("a grain that a slope holds presses it by m g cos, and is held by m g sin", "[contact_forces]")
{
    const double angle = 0.4, mass = 2;
    const Vec3d n(std::sin(angle), std::cos(angle), 0);
    Granular scene(points({{0.1f * Vec3f(n.cast<float>())}}).set<float>("pscale", {0.1f}).set<float>("mass", {2}));
    record(scene);
    scene.gravity().collide(make_plane(n, 0), 0.0f, 0.6f).substeps(4).run(12);
    CHECK(normal(scene) == Approx(mass * g * std::cos(angle)).epsilon(1e-5));
    CHECK(friction(scene) == Approx(mass * g * std::sin(angle)).epsilon(1e-5));
    CHECK(contacts(scene) == 1);
}

TEST_CASE("a grain that slides on a slope is held back by mu m g cos", "[contact_forces]")
{
    const double angle = 0.6;
    const Vec3d n(std::sin(angle), std::cos(angle), 0);
    Granular scene(points({{0.1f * Vec3f(n.cast<float>())}}).set<float>("pscale", {0.1f}));
    record(scene);
    scene.gravity().collide(make_plane(n, 0), 0.0f, 0.2f).substeps(4).run(12);
    CHECK(normal(scene) == Approx(g * std::cos(angle)).epsilon(1e-5));
    CHECK(friction(scene) == Approx(0.2 * g * std::cos(angle)).epsilon(1e-5));
}

TEST_CASE("each side of a smooth groove carries m g / sqrt 2", "[contact_forces]")
{
    const double root = std::sqrt(2.0);
    Granular scene(points({{0, static_cast<float>(0.1 * root), 0}}).set<float>("pscale", {0.1f}));
    record(scene);
    scene.gravity().collide(make_plane({1, 1, 0}, 0), 0.0f).collide(make_plane({-1, 1, 0}, 0), 0.0f);
    scene.substeps(4).run(6);
    CHECK(normal(scene) == Approx(root * g).epsilon(1e-4));
    CHECK(friction(scene) == Approx(0).margin(1e-3));
    CHECK(contacts(scene) == 2);
}

TEST_CASE("a ball that bounces without loss presses the floor by m g in the mean", "[contact_forces]")
{
    const double period = 0.5, height = g * period * period / 8;
    Granular scene(points({{0, static_cast<float>(height + 0.1), 0}}).set<float>("pscale", {0.1f}));
    record(scene);
    scene.gravity().floor(1).substeps(4);
    double impulse = 0;
    for (int frame = 0; frame < 12; ++frame) impulse += normal(scene.run(1)) / 24;
    CHECK(impulse / period == Approx(g).epsilon(1e-4));
    CHECK(contacts(scene) == 0);
}

TEST_CASE("an oblique impact is recorded by its impulses, on both points", "[contact_forces]")
{
    const float bounce = 0.5f, mu = 0.2f;
    Granular scene(points({{-0.15f, 0, 0}, {0.15f, 0, 0}})
                       .v({{4, 3, 0}, {0, 0, 0}})
                       .set<float>("pscale", {0.1f, 0.1f})
                       .set<float>("mass", {1, 3}),
                   bounce, mu);
    record(scene);
    scene.substeps(4).run(1);
    const Vec3d impulse = 3 * scene.v(1);
    const double n = normal(scene) / 24, t = friction(scene) / 24;
    CHECK(std::hypot(n, t) == Approx(impulse.norm()).epsilon(1e-5));
    CHECK(t == Approx(mu * n).epsilon(1e-5));
    CHECK(normal(scene, 1) == Approx(normal(scene, 0)));
}

TEST_CASE("next to a rod a contact is recorded once, by any number of iterations", "[contact_forces]")
{
    const int iterations = GENERATE(1, 2, 8);
    CAPTURE(iterations);
    const double mass = 2;
    Granular scene(points({{0, 0.1f, 0}, {0, 0.3f, 0}, {1, 0.1f, 0}, {1, 0.3f, 0}})
                       .set<float>("pscale", std::vector<float>(4, 0.1f))
                       .set<float>("mass", std::vector<float>(4, static_cast<float>(mass))),
                   0, 0.5f);
    record(scene);
    scene.dynamics.add(test::rods({{1, 3}}, 1));  // between the tops, level: it carries nothing
    scene.options.iterations = iterations;
    scene.gravity().floor(0, 0.5f).substeps(16).run(48);
    for (const std::size_t bottom : {0u, 2u}) {
        CAPTURE(bottom);
        CHECK(normal(scene, bottom + 1) == Approx(mass * g).epsilon(2e-3));
        CHECK(normal(scene, bottom) == Approx(3 * mass * g).epsilon(2e-3));
        CHECK(contacts(scene, bottom + 1) == 1);
        CHECK(contacts(scene, bottom) == 2);
    }
}

TEST_CASE("next to a rod friction and its work are recorded once, by any number of iterations", "[contact_forces]")
{
    const auto impact = [](int iterations, double& force) {
        Granular scene(points({{-0.15f, 0, 0}, {0.15f, 0, 0}, {5, 0, 0}, {6, 0, 0}})
                           .v({{4, 3, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}})
                           .set<float>("pscale", std::vector<float>(4, 0.1f))
                           .set<float>("mass", {1, 3, 1, 1}),
                       0.5f, 0.2f);
        record(scene);
        scene.dynamics.add(test::rods({{2, 3}}, 1));
        scene.options.iterations = iterations;
        scene.collide(make_plane({0, 1, 0}, -5), 0.0f).substeps(4).run(1);
        force = friction(scene);
        REQUIRE(scene.last.ledger);
        REQUIRE(scene.last.ledger->by.split);
        return scene.last.ledger->by.split->friction;
    };
    double once = 0, often = 0;
    const double work_once = impact(1, once), work_often = impact(8, often);
    CHECK(once > 0);
    CHECK(often == Approx(once));
    CHECK(work_once < 0);
    CHECK(work_often == Approx(work_once));
}

TEST_CASE("what sleeps keeps the forces that it fell asleep under", "[contact_forces]")
{
    Granular scene(column(5, 0.02f, 1), 0, 0.5f);
    record(scene);
    scene.gravity().floor(0, 0.5f).substeps(12).sleep().run(96);
    REQUIRE(scene.last.asleep == 5);
    for (std::size_t i = 0; i < 5; ++i)
        CHECK(normal(scene, i) == Approx(static_cast<double>(9 - 2 * i) * g).epsilon(5e-3));
}

TEST_CASE("recording changes no bit of the motion", "[contact_forces]")
{
    const auto run = [](bool records) {
        std::vector<Vec3f> at;
        for (int k = 0; k < 60; ++k)
            at.emplace_back(0.041f * static_cast<float>(k % 4), 0.05f * static_cast<float>(k / 8 + 1),
                            0.043f * static_cast<float>(k / 4 % 2));
        Granular scene(points(at).set<float>("pscale", std::vector<float>(60, 0.02f)), 0.3f, 0.4f);
        if (records) record(scene);
        scene.gravity().floor(0.3f, 0.4f).substeps(6).run(24);
        return scene.points;
    };
    CHECK(same_bits(run(false), run(true)));
}

}  // namespace
}  // namespace rapid
