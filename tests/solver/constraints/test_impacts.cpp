// Impacts between points, and of points that impacts drive into shapes: the closed form of a single one, cradles,
// gases, Haff's law; no impact adds energy.
#include "runtime/solver/constraints/impact.h"

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

using test::alike;
double kinetic_energy(const Granular& scene)
{
    const auto* mass = scene.points.find<float>("mass");
    double sum = 0;
    for (std::size_t i = 0; i < scene.points.size(); ++i)
        sum += 0.5 * (mass ? (*mass)[i] : 1.0f) * scene.v(i).squaredNorm();
    return sum;
}

// Frictionless walls around the origin, at this distance.
void enclose(Granular& scene, double half, float bounce)
{
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) scene.collide(make_plane(side * Vec3d::Unit(axis), -half), bounce);
}

TEST_CASE("an oblique impact is that of its closed form, at any angle, ratio of masses, restitution and friction",
          "[impacts]")
{
    const double angle = GENERATE(0.0, 0.4, 0.8, 1.2, 1.5), ratio = GENERATE(1e-3, 1.0, 30.0);
    const float bounce = GENERATE(0.1f, 0.5f, 1.0f), friction = GENERATE(0.0f, 0.3f);
    const int substeps = GENERATE(2, 5, 16);
    CAPTURE(angle, ratio, bounce, friction, substeps);
    const double h = 1.0 / 24, hit = 0.61 * h, reach = 0.2;
    const Vec3d va(1.5, 0.1, -0.2), vb(0.3, 0.4, 0.1), along = (va - vb).normalized();
    const Vec3d across = along.cross(Vec3d::UnitZ()).normalized();
    const Vec3d n = -std::cos(angle) * along + std::sin(angle) * across;  // from b to a, at the impact

    Granular scene(points({Vec3f((reach * n - hit * va).cast<float>()), Vec3f((-hit * vb).cast<float>())})
                       .v({Vec3f(va.cast<float>()), Vec3f(vb.cast<float>())})
                       .set<float>("mass", {1, static_cast<float>(ratio)})
                       .set<float>("pscale", alike(2, 0.1f)),
                   bounce, friction);
    const double before = kinetic_energy(scene);
    scene.substeps(substeps).run(1);

    const Vec3d u = va - vb, sliding = u - u.dot(n) * n;
    const double reduced = ratio / (1 + ratio), p = -(1 + bounce) * u.dot(n) * reduced;
    Vec3d impulse = p * n;
    if (sliding.norm() > 1e-9) impulse -= std::min(friction * p, reduced * sliding.norm()) * sliding.normalized();
    const Vec3d va1 = va + impulse, vb1 = vb - impulse / ratio;
    // A glancing impact amplifies the rounding of positions in its normal by 1/cos(angle).
    const double rounding = 3e-7 / std::cos(angle) * std::max(1.0, 1 / ratio);
    CHECK_THAT(scene.v(0), close_to(va1, 10 * rounding));
    CHECK_THAT(scene.v(1), close_to(vb1, 10 * rounding));
    CHECK_THAT(scene.P(0), close_to(Vec3d(reach * n + (h - hit) * va1), rounding));
    CHECK_THAT(scene.P(1), close_to(Vec3d((h - hit) * vb1), rounding));
    const Vec3d momentum = va + ratio * vb;
    CHECK((scene.momentum() - momentum).norm() < 4e-7 * (1 + ratio));
    CHECK(kinetic_energy(scene) <= before * (1 + 4e-7));
}

TEST_CASE("points that fall together meet as if they did not", "[impacts]")
{
    const auto colliding = [] {
        return Granular(
            points({{-0.15f, 0, 0}, {0.15f, 0.05f, 0}}).v({{2, 0, 0}, {-2, 0, 0}}).set<float>("pscale", alike(2, 0.1f)),
            1);
    };
    Granular scene = colliding(), falling = colliding();
    scene.substeps(4).run(2);
    falling.gravity().substeps(4).run(2);
    const double t = 2.0 / 24;
    for (std::size_t i = 0; i < 2; ++i) {
        CHECK_THAT(falling.v(i), close_to(Vec3d(scene.v(i) - Vec3d(0, g * t, 0)), 1e-6));
        CHECK_THAT(falling.P(i), close_to(Vec3d(scene.P(i) - Vec3d(0, 0.5 * g * t * t, 0)), 1e-6));
    }
}

TEST_CASE("a ball that hits a row of balls sends the last away with all of its velocity", "[impacts]")
{
    const int substeps = GENERATE(1, 4, 16);
    CAPTURE(substeps);
    std::vector<Vec3f> at{{-0.16f, 0, 0}}, v{{1, 0, 0}};
    for (int k = 0; k < 5; ++k) at.emplace_back(0.1f * static_cast<float>(k), 0, 0), v.emplace_back(0, 0, 0);
    Granular scene(points(at).v(v).set<float>("pscale", alike(6, 0.05f)), 1);
    scene.substeps(substeps).run(24);
    for (std::size_t k = 0; k < 6; ++k) CHECK_THAT(scene.v(k), close_to(Vec3d(k == 5 ? 1 : 0, 0, 0), 1e-5));
    CHECK(kinetic_energy(scene) <= 0.5 * (1 + 1e-6));
}

// n³ points on a lattice, moving in random directions at `speed`.
Granular gas(int n, float speed, float bounce)
{
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    std::vector<Vec3f> at, v;
    const auto place = [&](int k) { return 0.15f * (static_cast<float>(k) - 0.5f * static_cast<float>(n - 1)); };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
            for (int k = 0; k < n; ++k) {
                at.emplace_back(place(i), place(j), place(k));
                v.push_back(speed * Vec3f(normal(random), normal(random), normal(random)).normalized());
            }
    Granular scene(points(at).v(v).set<float>("pscale", alike(at.size(), 0.05f)), bounce);
    enclose(scene, 0.075 * n + 0.025, 1);
    scene.substeps(16);
    return scene;
}

void check_that_a_gas_keeps_its_energy(int seconds)
{
    Granular scene = gas(7, 1, 1);
    const double before = kinetic_energy(scene);
    for (int second = 0; second < seconds; ++second) {
        scene.run(24);
        CHECK(kinetic_energy(scene) <= before * (1 + 1e-5));
    }
    CHECK(kinetic_energy(scene) >= before * 0.99);
}

TEST_CASE("a gas of elastic spheres in a box keeps its energy for 5 s", "[impacts]")
{
    check_that_a_gas_keeps_its_energy(5);
}

TEST_CASE("a gas of elastic spheres in a box keeps its energy for a minute", "[impacts][long]")
{
    check_that_a_gas_keeps_its_energy(60);
}

// Spheres of one size and mass in a box, from impact to impact.
class EventDriven {
public:
    EventDriven(const Granular& scene, double radius, double half, double restitution)
        : reach_(2 * radius), half_(half - radius), restitution_(restitution)
    {
        for (std::size_t i = 0; i < scene.points.size(); ++i) P_.push_back(scene.P(i)), v_.push_back(scene.v(i));
        next_.resize(P_.size());
        for (std::size_t i = 0; i < P_.size(); ++i) look_ahead(i);
    }

    void run_until(double end)
    {
        for (;;) {
            const std::size_t i = static_cast<std::size_t>(
                std::min_element(next_.begin(), next_.end(),
                                 [](const Event& a, const Event& b) { return a.time < b.time; }) -
                next_.begin());
            const Event event = next_[i];
            advance(std::min(event.time, end));
            if (event.time > end) return;
            if (event.with < P_.size())
                collide(i, event.with);
            else
                v_[i][static_cast<int>(event.with - P_.size())] *= -1;
            for (std::size_t k = 0; k < P_.size(); ++k)
                if (k == i || k == event.with || next_[k].with == i || next_[k].with == event.with) look_ahead(k);
        }
    }
    double kinetic_energy() const
    {
        double sum = 0;
        for (const Vec3d& v : v_) sum += 0.5 * v.squaredNorm();
        return sum;
    }

private:
    struct Event {
        double time;
        std::size_t with;  // a point or, from size() on, an axis of a wall
    };

    void advance(double to)
    {
        for (std::size_t i = 0; i < P_.size(); ++i) P_[i] += (to - now_) * v_[i];
        now_ = to;
    }
    void collide(std::size_t i, std::size_t j)
    {
        const Vec3d n = (P_[i] - P_[j]).normalized();
        const Vec3d impulse = -0.5 * (1 + restitution_) * (v_[i] - v_[j]).dot(n) * n;
        v_[i] += impulse;
        v_[j] -= impulse;
    }
    void look_ahead(std::size_t i)
    {
        next_[i] = {std::numeric_limits<double>::infinity(), P_.size() + 3};
        const auto take = [&](double after, std::size_t with) {
            if (now_ + after < next_[i].time) next_[i] = {now_ + after, with};
        };
        for (int axis = 0; axis < 3; ++axis) {
            const double v = v_[i][axis];
            if (v != 0)
                take(std::max(0.0, (std::copysign(half_, v) - P_[i][axis]) / v),
                     P_.size() + static_cast<std::size_t>(axis));
        }
        for (std::size_t j = 0; j < P_.size(); ++j) {
            const Vec3d d = P_[i] - P_[j], u = v_[i] - v_[j];
            const double b = d.dot(u), root2 = b * b - u.squaredNorm() * (d.squaredNorm() - reach_ * reach_);
            if (j != i && b < 0 && root2 > 0) take(std::max(0.0, (-b - std::sqrt(root2)) / u.squaredNorm()), j);
        }
    }

    double reach_, half_, restitution_, now_ = 0;
    std::vector<Vec3d> P_, v_;
    std::vector<Event> next_;
};

TEST_CASE("a gas of inelastic spheres cools as its events, one by one, say", "[impacts]")
{
    const int n = 6;
    Granular scene = gas(n, 5, 0.9f);
    EventDriven events(scene, 0.05, 0.075 * n + 0.025, 0.9);
    const double before = kinetic_energy(scene);
    scene.run(24);
    events.run_until(1);
    CAPTURE(events.kinetic_energy() / before);
    CHECK(kinetic_energy(scene) / events.kinetic_energy() == Approx(1).epsilon(0.1));
    scene.run(48);
    events.run_until(3);
    CAPTURE(events.kinetic_energy() / before);
    CHECK(kinetic_energy(scene) / events.kinetic_energy() == Approx(1).epsilon(0.1));
}

TEST_CASE("balls that bounce on one that lies on the ground gain no energy", "[impacts]")
{
    const int substeps = GENERATE(4, 16);
    CAPTURE(substeps);
    Granular scene(points({{0, 0.1f, 0}, {0.01f, 1.1f, 0}}).set<float>("pscale", alike(2, 0.1f)), 1);
    scene.gravity().floor(1).substeps(substeps);
    const auto energy = [&] { return kinetic_energy(scene) + g * (scene.P(0).y() + scene.P(1).y()); };
    const double before = energy();
    for (int frame = 0; frame < 240; ++frame) {
        scene.run(1);
        REQUIRE(energy() <= before * (1 + 1e-4));
    }
}

// Clusters that fly into each other, with any masses, friction and iterations, some born overlapping, some between
// walls.
TEST_CASE("impacts of random clusters add no energy, and keep the momentum where there are no walls", "[impacts][slow]")
{
    std::mt19937 random(11);
    const auto in = [&](double low, double high) {
        return static_cast<float>(std::uniform_real_distribution<double>(low, high)(random));
    };
    for (int cluster = 0; cluster < 120; ++cluster) {
        CAPTURE(cluster);
        const std::size_t n = 2 + random() % 24;
        const float decades = in(0, 3), friction = random() % 2 ? in(0, 1.5) : 0.0f;
        std::vector<Vec3f> at, v;
        std::vector<float> mass, radius;
        for (std::size_t k = 0; k < n; ++k) {
            at.emplace_back(in(-0.4, 0.4), in(-0.4, 0.4), in(-0.4, 0.4));
            v.push_back(Vec3f(in(-1, 1), in(-1, 1), in(-1, 1)) - at.back());
            mass.push_back(std::pow(10.0f, in(-decades, decades)));
            radius.push_back(in(0.02, 0.1));
        }
        Granular scene(points(at).v(v).set<float>("mass", mass).set<float>("pscale", radius),
                       random() % 3 ? in(0, 1) : 1.0f, friction);
        const bool walls = random() % 2;
        if (walls) enclose(scene, 0.5, in(0, 1));
        scene.options.iterations = 1 << random() % 4;
        scene.substeps(1 << random() % 6);
        const double before = kinetic_energy(scene);
        const Vec3d momentum = scene.momentum();
        double size = 0;
        for (std::size_t k = 0; k < n; ++k) size += mass[k] * v[k].norm();
        for (int frame = 0; frame < 24; ++frame) {
            scene.run(1);
            REQUIRE(kinetic_energy(scene) <= before * (1 + 1e-6));
        }
        if (!walls) CHECK((scene.momentum() - momentum).norm() < 1e-5 * size);
    }
}

TEST_CASE("a sleeper on the ground that an impact passes on to rises no faster than it is hit", "[impacts][sleep]")
{
    // The second sleeper is hit in the same substep as the first; before that it is no candidate for a contact.
    Granular scene(points({{0, 0.1f, 0}, {0.2f, 0.1f, 0}, {0.4f, 0.1f, 0}}).set<float>("pscale", alike(3, 0.1f)), 1);
    scene.gravity().floor(0.5f).substeps(2).sleep().run(24);
    REQUIRE(scene.last.asleep == 3);
    auto v = scene.points.v().write();
    auto P = scene.points.P().write();
    P[0] = Vec3f(-1, 0.11f, 0);
    v[0] = Vec3f(5, 0, 0);
    const double before = 0.5 * 25 + g * (0.11 - 0.1);
    for (int frame = 0; frame < 24; ++frame) {
        scene.run(1);
        double energy = kinetic_energy(scene);
        for (std::size_t i = 0; i < 3; ++i) energy += g * (scene.P(i).y() - 0.1);
        REQUIRE(energy <= before * (1 + 1e-3));
    }
    CHECK(scene.v(2).x() > 4);
}

TEST_CASE("a bouncing cluster has the same bits on any number of threads", "[impacts][threads]")
{
    const auto run = [](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        Granular scene = gas(16, 2, 0.8f);
        scene.gravity().run(6);
        return scene.points;
    };
    const PointSet one = run(1);
    CHECK(same_bits(one, run(2)));
    CHECK(same_bits(one, run(7)));
}

}  // namespace
}  // namespace rapid
