// Energy and momentum of points linked by rods and springs, without other forces: random chains, trees and nets, with
// masses over decades, at any number of substeps.
#include <rapidcheck.h>

#include <cmath>
#include <random>

#include "tests/solver/constraints/rods.h"
#include "tests/solver/scene.h"

namespace rapid {
namespace {

using test::immovable;
using test::links_of_chain;
using test::points;
using test::rods;
using test::Scene;

using Links = std::vector<std::array<std::int64_t, 2>>;

struct Linked {
    std::vector<Vec3f> P, v;
    std::vector<float> mass;
    Links links;
};

// n points in a ball, each linked to an earlier one, and `more` additional links.
Linked random_links(unsigned seed, int n, int more, double decades)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> number(-1, 1);
    Linked made;
    for (int i = 0; i < n; ++i) {
        made.P.emplace_back(number(random), number(random), number(random));
        made.v.emplace_back(number(random), number(random), number(random));
        made.mass.push_back(static_cast<float>(std::pow(10, 0.5 * decades * number(random))));
        if (i > 0) made.links.push_back({static_cast<std::int64_t>(random() % static_cast<unsigned>(i)), i});
    }
    for (int k = 0; k < more && n > 2; ++k) {
        const auto i = static_cast<std::int64_t>(random() % static_cast<unsigned>(n));
        const auto j = static_cast<std::int64_t>(random() % static_cast<unsigned>(n));
        if (i != j) made.links.push_back({i, j});
    }
    return made;
}

// A rod with its own discrete gradient.
struct OwnRod : test::Rod {
    void discrete_gradient(const std::array<Vec3d, 2>& from, const std::array<Vec3d, 2>& to,
                           std::array<Vec3d, 2>& gradient) const
    {
        const Vec3d d = from[0] - from[1], e = to[0] - to[1];
        gradient[0] = (d + e) / (d.norm() + e.norm());
        gradient[1] = -gradient[0];
    }
};

Scene scene_of(const Linked& linked, double compliance, int substeps)
{
    Scene scene(points(linked.P).v(linked.v).set<float>("mass", linked.mass));
    auto made = std::make_shared<test::RowsConstraint<OwnRod>>();
    made->node = "rods1";
    for (const auto& link : linked.links) {
        const Vec3d d =
            (linked.P[static_cast<std::size_t>(link[0])] - linked.P[static_cast<std::size_t>(link[1])]).cast<double>();
        made->rows->add(link, {{d.norm()}}, compliance);
    }
    scene.dynamics.add(made);
    scene.substeps(substeps);
    return scene;
}

double energy_of_links(const Scene& scene, const Linked& linked)
{
    double sum = 0;
    for (std::size_t i = 0; i < linked.P.size(); ++i) sum += 0.5 * linked.mass[i] * scene.v(i).squaredNorm();
    return sum;
}

TEST_CASE("rods give no energy, whatever they link and however they turn", "[constraints]")
{
    rc::prop("the kinetic energy does not grow, and momentum is kept", [] {
        const auto seed = *rc::gen::arbitrary<unsigned>();
        const int n = *rc::gen::inRange(2, 12), more = *rc::gen::element(0, 0, 1, 5, 30);
        const double decades = *rc::gen::element(0.0, 3.0, 6.0), speed = *rc::gen::element(0.1, 3.0, 100.0);
        const int substeps = *rc::gen::element(1, 2, 7, 16);
        Linked linked = random_links(seed, n, more, decades);
        Vec3d momentum = Vec3d::Zero();
        double size = 0;
        for (std::size_t i = 0; i < linked.P.size(); ++i) {
            linked.v[i] *= static_cast<float>(speed);
            momentum += linked.mass[i] * linked.v[i].cast<double>();
            size += linked.mass[i] * linked.v[i].cast<double>().norm();
        }
        Scene scene = scene_of(linked, 0, substeps);
        double before = energy_of_links(scene, linked);
        for (int f = 0; f < 12; ++f) {
            scene.run(1);
            const double now = energy_of_links(scene, linked);
            // Positions and velocities are rounded once per frame.
            RC_ASSERT(now <= before * (1 + 1e-5));
            before = now;
        }
        for (std::size_t i = 0; i < linked.P.size(); ++i) momentum -= linked.mass[i] * scene.v(i);
        RC_ASSERT(momentum.norm() <= 1e-4 * size);
    });
}

TEST_CASE("springs between points give no energy, however stiff", "[constraints]")
{
    rc::prop("kinetic and elastic energy do not grow", [] {
        const auto seed = *rc::gen::arbitrary<unsigned>();
        const int n = *rc::gen::inRange(2, 8);
        const double compliance = *rc::gen::element(1e-9, 1e-6, 1e-4, 1e-2, 1.0);
        const int substeps = *rc::gen::element(1, 2, 7, 16);
        const Linked linked = random_links(seed, n, 0, 3);
        Scene scene = scene_of(linked, compliance, substeps);
        const auto energy = [&] {
            double sum = energy_of_links(scene, linked);
            for (const auto& link : linked.links) {
                const auto i = static_cast<std::size_t>(link[0]), j = static_cast<std::size_t>(link[1]);
                const double stretch =
                    (scene.P(i) - scene.P(j)).norm() - (linked.P[i] - linked.P[j]).cast<double>().norm();
                sum += 0.5 * stretch * stretch / compliance;
            }
            return sum;
        };
        const double first = energy();
        for (int f = 0; f < 12; ++f) {
            scene.run(1);
            // A position rounded by 6e-8 stretches a spring.
            RC_ASSERT(energy() <= first * (1 + 1e-4) + 1e-14 * n / compliance);
        }
    });
}

TEST_CASE("two heavy points with a light hub between them lose less than 1 % a second", "[constraints]")
{
    const Linked linked{{{1, 0, 0}, {0, 0, 0}, {-0.8f, 0.6f, 0}},
                        {{0.3f, 1, 0.2f}, {0.1f, 0.2f, 0}, {-0.4f, 0.1f, -0.5f}},
                        {1, 0.001f, 1},
                        links_of_chain(2)};
    Scene scene = scene_of(linked, 0, 16);
    scene.run(1);  // removes the initial velocities along the rods
    const double first = energy_of_links(scene, linked);
    scene.run(120);
    CHECK(energy_of_links(scene, linked) <= first * (1 + 1e-5));
    CHECK(energy_of_links(scene, linked) >= first * 0.95);
}

TEST_CASE("a free dumbbell at 0.2 rad a sub-step keeps energy and angular momentum", "[constraints]")
{
    const double rate = 0.2 * 24 * 4;
    const Linked linked{{{0.5f, 0, 0}, {-0.5f, 0, 0}},
                        {{0, static_cast<float>(rate * 0.75), 0}, {0, static_cast<float>(-rate * 0.25), 0}},
                        {1, 3},
                        links_of_chain(1)};
    Scene scene = scene_of(linked, 0, 4);
    const auto spin = [&] { return Vec3d(scene.P(0).cross(scene.v(0)) + 3 * scene.P(1).cross(scene.v(1))); };
    const double first = energy_of_links(scene, linked);
    const Vec3d L = spin();
    scene.run(240);
    CHECK(energy_of_links(scene, linked) == Approx(first).epsilon(1e-4));
    CHECK((spin() - L).norm() < 1e-4 * L.norm());
}

TEST_CASE("an undamped spring swings by its closed form, to second order", "[constraints]")
{
    const double compliance = 0.01, W = 1.0 + 1.0 / 3, omega = std::sqrt(W / compliance);
    const auto error_with = [&](int substeps) {
        const Linked linked{{{0, 0, 0}, {1, 0, 0}}, {{-0.3f, 0, 0}, {0.1f, 0, 0}}, {1, 3}, links_of_chain(1)};
        Scene scene = scene_of(linked, compliance, substeps);
        scene.run(48);
        const double exact = 1 + 0.4 / omega * std::sin(omega * 2);
        return std::abs((scene.P(1) - scene.P(0)).norm() - exact);
    };
    const double coarse = error_with(8), fine = error_with(16);
    CAPTURE(coarse, fine);
    CHECK(coarse < 2e-3);
    CHECK(coarse / fine > 3.5);
}

TEST_CASE("a rod between pins that are too far apart yields, and throws nothing", "[constraints]")
{
    Linked linked{
        {{0, 0, 0}, {0.5f, 0.1f, 0}, {1, 0, 0}}, {{0, 0, 0}, {1, -4, 2}, {0, 0, 0}}, {immovable, 1, immovable}, {}};
    Scene scene(points(linked.P).v(linked.v).set<float>("mass", linked.mass));
    scene.dynamics.add(rods(links_of_chain(2), 0.3));
    scene.run(48);
    CHECK(scene.v(1).norm() < 5);
    CHECK(scene.P(1).norm() < 2);
    CHECK(scene.last.constraint_residual_max > 0.1);
}

}  // namespace
}  // namespace rapid
