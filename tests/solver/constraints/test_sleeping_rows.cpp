// Sleep of points that rows link: they fall asleep only in balance, and a whole island wakes when any of it is moved,
// hit, pulled or released.
#include <tbb/global_control.h>

#include <cmath>
#include <limits>

#include "runtime/solver/constraints/sleep.h"
#include "tests/solver/constraints/granular.h"
#include "tests/solver/constraints/rods.h"

namespace rapid {
namespace {

using test::close_to;
using test::Granular;
using test::immovable;
using test::links_of_chain;
using test::points;
using test::rods;
using test::same_bits;
using test::Scene;

using test::g;

class Drag : public Force {
public:
    explicit Drag(double rate) : rate_(rate) {}
    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        for (std::size_t i = 0; i < chunk.size(); ++i) forces.add_drag(i, rate_, Vec3d::Zero());
    }

private:
    double rate_;  // 1/s
};

struct Restless : test::Rod {
    static constexpr bool rests = false;
};

double fastest(const Scene& scene)
{
    double most = 0;
    for (std::size_t i = 0; i < scene.points.size(); ++i) most = std::max(most, scene.v(i).norm());
    return most;
}

// A rope of links of 0.1 m that hangs from an immovable point, slightly deflected, in air.
Scene rope(std::size_t links, double compliance = 0)
{
    std::vector<Vec3f> at;
    std::vector<float> masses(links + 1, 1.0f);
    masses[0] = immovable;
    for (std::size_t k = 0; k <= links; ++k)
        at.emplace_back(0.06f * static_cast<float>(k), -0.08f * static_cast<float>(k), 0.0f);
    Scene scene(points(at).set<float>("mass", masses));
    scene.gravity().substeps(8);
    scene.dynamics.add(std::make_shared<Drag>(5));
    scene.dynamics.add(rods(links_of_chain(static_cast<std::int64_t>(links)), 0.1, compliance));
    return scene;
}

void fall_asleep(Scene& scene, std::uint64_t all, int frames = 480)
{
    scene.sleep();
    while (scene.last.asleep < all && scene.options.frame < frames) scene.run(1);
    REQUIRE(scene.last.asleep == all);
    REQUIRE(fastest(scene) == 0);
}

TEST_CASE("a pendulum of a long period never falls asleep, and keeps its phase", "[sleep]")
{
    // The swing is so small that at its ends it is slower, for half a second, than the limit for points in a heap.
    const double length = 100, width = 0.1, omega = std::sqrt(g / length);
    const int substeps = GENERATE(1, 12);
    CAPTURE(substeps);
    const Vec3f from(static_cast<float>(width), static_cast<float>(length - std::sqrt(length * length - width * width)),
                     0);
    Scene scene(points({{0, static_cast<float>(length), 0}, from}).set<float>("mass", {immovable, 1}));
    scene.gravity().substeps(substeps).sleep();
    scene.dynamics.add(rods({{0, 1}}, (scene.P(0) - scene.P(1)).norm()));
    double off = 0;
    std::uint64_t asleep = 0;
    for (int frame = 0; frame < 2400; ++frame) {  // 100 s: five periods
        scene.run(1);
        asleep += scene.last.asleep;
        off = std::max(off, std::abs(scene.P(1).x() - width * std::cos(omega * scene.options.time)));
    }
    CHECK(asleep == 0);
    CHECK(off < 0.01 * width);
}

TEST_CASE("a rope falls asleep where it hangs in balance", "[sleep]")
{
    Scene scene = rope(20);
    fall_asleep(scene, 20);
    for (std::size_t k = 0; k <= 20; ++k) {
        CHECK(scene.P(k).x() == Approx(0).margin(3e-4));
        CHECK(scene.P(k).y() == Approx(-0.1 * static_cast<double>(k)).margin(1e-4));
    }
    const PointSet rests = scene.points;
    scene.run(100);
    CHECK(same_bits(scene.points, rests));
    CHECK(scene.last.asleep == 20);
    CHECK(scene.last.constraint_rows == 20);  // sleeping rows are counted, too
}

TEST_CASE("all of a sleeping rope wakes when any part of it changes", "[sleep]")
{
    Scene scene = rope(10);
    fall_asleep(scene, 10);
    SECTION("its support is moved")
    {
        scene.points.P().write()[0] = Vec3f(0.02f, 0, 0);
        scene.run(12);
        CHECK(scene.P(1).x() > 0.01);
        CHECK(scene.P(10).x() > 1e-4);
        CHECK(scene.last.asleep == 0);
    }
    SECTION("its support moves by itself")
    {
        scene.points.v().write()[0] = Vec3f(0.1f, 0, 0);
        scene.run(24);
        CHECK(scene.P(1).x() > 0.05);
        CHECK((scene.P(1) - scene.P(0)).norm() == Approx(0.1).epsilon(1e-3));
    }
    SECTION("a node moves one of its points")
    {
        scene.points.P().write()[5].x() = 0.05f;
        scene.run(2);
        CHECK(scene.P(4).x() > 0.001);
        CHECK(scene.P(6).x() > 0.001);
    }
    SECTION("a node gives one of its points a velocity")
    {
        scene.points.v().write()[10] = Vec3f(1, 0, 0);
        scene.run(2);
        CHECK(scene.P(10).x() > 0.02);
        CHECK(scene.P(9).x() > 1e-4);
    }
    SECTION("a hundredth of its weight pulls aside")
    {
        scene.gravity({0.01 * g, 0, 0}).run(240);
        CHECK(scene.P(10).x() == Approx(0.01).epsilon(0.05));
        CHECK(scene.last.asleep == 10);  // in the new position
    }
    SECTION("one of its points dies")
    {
        std::vector<std::uint8_t> keep(11, 1);
        keep[5] = 0;
        scene.points.keep(keep);
        scene.run(1);
        CHECK(scene.v(9).y() == Approx(-g / 24).epsilon(0.15));  // with drag
        CHECK(scene.P(4).y() == Approx(-0.4).margin(1e-3));
    }
    SECTION("its only row goes")
    {
        std::vector<std::uint8_t> keep(11, 0);
        keep[10] = 1;
        scene.points.keep(keep);
        scene.run(1);
        CHECK(scene.v(0).y() == Approx(-g / 24).epsilon(0.15));
    }
}

TEST_CASE("a sleeping weight on a spring sinks when it grows heavier", "[sleep]")
{
    const double compliance = 1e-3;
    Scene scene = rope(1, compliance);
    fall_asleep(scene, 1);
    CHECK(scene.P(1).y() == Approx(-0.1 - compliance * g).margin(1e-5));
    scene.points.set("mass", Column<float>(std::vector<float>{immovable, 3}));
    scene.run(240);
    CHECK(scene.P(1).y() == Approx(-0.1 - 3 * compliance * g).margin(1e-5));
}

TEST_CASE("a rope wakes with the forces that it fell asleep with", "[sleep]")
{
    Scene scene = rope(20, 1e-5);
    fall_asleep(scene, 20);
    scene.points.v().write()[20] = Vec3f(1e-3f, 0, 0);
    for (int frame = 0; frame < 6; ++frame) {
        scene.run(1);
        CHECK(scene.last.asleep == 0);
        CHECK(fastest(scene) < 2e-3);  // g dt is 0.05
    }
}

// A woken sleeper has no free motion in the substep in which it wakes.
TEST_CASE("a rope whose end a force wakes moves as an awake one", "[sleep]")
{
    bool pulls = false;
    Scene scene = rope(4);
    scene.force(
        [&pulls](const Chunk& chunk, std::size_t i) { return Vec3d(pulls && chunk.first + i == 4 ? 200 : 0, 0, 0); });
    fall_asleep(scene, 4);
    pulls = true;
    Scene awake = scene;
    awake.options.sleep_records = nullptr;
    awake.options.sleep = std::numeric_limits<double>::infinity();
    for (Scene* each : {&scene, &awake}) each->run(1);
    CHECK(scene.last.asleep == 0);
    CHECK(awake.v(4).x() > 1);
    for (std::size_t i = 0; i <= 4; ++i) {
        CHECK_THAT(scene.P(i), close_to(awake.P(i), 1e-5));
        CHECK_THAT(scene.v(i), close_to(awake.v(i), 1e-3));
    }
}

TEST_CASE("two ropes on one immovable point sleep independently", "[sleep]")
{
    Scene scene(points({{0, 0, 0}, {0.1f, 0, 0}, {-0.1f, 0, 0}}).set<float>("mass", {immovable, 1, 1}));
    scene.gravity().substeps(8);
    scene.dynamics.add(std::make_shared<Drag>(5));
    scene.dynamics.add(rods({{0, 1}, {0, 2}}, 0.1));
    fall_asleep(scene, 2);
    scene.points.v().write()[1] = Vec3f(0.1f, 0, 0);
    scene.run(1);
    CHECK(scene.last.asleep == 1);
    CHECK(scene.v(2).norm() == 0);
}

TEST_CASE("points of rows whose function does not say that it rests stay awake", "[sleep]")
{
    Scene scene(points({{0, 0, 0}, {0, -0.1f, 0}}).set<float>("mass", {immovable, 1}));
    scene.gravity().substeps(8).sleep();
    scene.dynamics.add(rods<Restless>({{0, 1}}, 0.1));
    scene.run(48);
    CHECK(scene.last.asleep == 0);
    CHECK(scene.v(1).norm() < 1e-6);
}

// A net of n by n knots that hangs from its corners in air; then the radius of the ball that lies after them.
Granular net(std::int64_t n, const Vec3f& ball)
{
    std::vector<Vec3f> at;
    std::vector<float> masses, radius;
    std::vector<std::array<std::int64_t, 2>> pairs;
    for (std::int64_t i = 0; i < n; ++i)
        for (std::int64_t j = 0; j < n; ++j) {
            at.emplace_back(0.09f * static_cast<float>(i), 0.0f, 0.09f * static_cast<float>(j));
            masses.push_back((i == 0 || i == n - 1) && (j == 0 || j == n - 1) ? immovable : 0.1f);
            radius.push_back(0.04f);
            if (i > 0) pairs.push_back({(i - 1) * n + j, i * n + j});
            if (j > 0) pairs.push_back({i * n + j - 1, i * n + j});
        }
    at.push_back(ball);
    masses.push_back(1);
    radius.push_back(0.1f);
    Granular scene(points(at).set<float>("mass", masses).set<float>("pscale", radius));
    scene.gravity().substeps(12);
    scene.dynamics.add(std::make_shared<Drag>(3));
    scene.dynamics.add(rods(pairs, 0.1));
    return scene;
}

TEST_CASE("a ball wakes all of a sleeping net, and is caught as by an awake one", "[sleep][slow]")
{
    const auto caught = [](bool sleeps) {
        Granular scene = net(8, {0.3f, -10, 0.3f});
        scene.points.column<float>("mass").write()[64] = immovable;  // held in place at first
        if (sleeps) fall_asleep(scene, 60, 720);
        scene.run(720 - static_cast<int>(scene.options.frame));
        CHECK(scene.last.asleep == (sleeps ? 60 : 0));
        scene.points.column<float>("mass").write()[64] = 1;
        scene.points.P().write()[64] = Vec3f(0.3f, 0.3f, 0.3f);
        std::vector<double> heights;
        for (int frame = 0; frame < 48; ++frame) {
            scene.run(1);
            heights.push_back(scene.P(64).y());
        }
        CHECK(scene.last.asleep == 0);
        return heights;
    };
    const std::vector<double> by_sleeping = caught(true), by_awake = caught(false);
    CHECK(by_awake.back() > -1);
    for (std::size_t f = 0; f < by_awake.size(); ++f) CHECK(by_sleeping[f] == Approx(by_awake[f]).margin(0.01));
}

// Pairs of grains, each a rod, that fall into a box, with side by 2 side of them per layer.
Granular dumbbells(std::int64_t n, std::int64_t side)
{
    const float r = 0.05f;
    std::vector<Vec3f> at;
    std::vector<std::array<std::int64_t, 2>> pairs;
    for (std::int64_t k = 0; k < n; ++k)
        for (const float end : {-1.0f, 1.0f})
            at.emplace_back(
                4.6f * r * (static_cast<float>(k % side) + 0.5f) + end * r,
                2.2f * r * (static_cast<float>(k / (2 * side * side)) + 0.5f) + 0.01f * r * static_cast<float>(k % 7),
                2.3f * r * (static_cast<float>(k / side % (2 * side)) + 0.5f) + 0.01f * r * static_cast<float>(k % 5));
    for (std::int64_t k = 0; k < n; ++k) pairs.push_back({2 * k, 2 * k + 1});
    Granular scene(points(at).set<float>("pscale", std::vector<float>(at.size(), r)), 0, 0.4f);
    scene.gravity().floor(0, 0.4f).substeps(12);
    const double w = 4.6 * r * static_cast<double>(side);
    scene.collide(make_plane({1, 0, 0}, 0), 0.0f, 0.4f).collide(make_plane({-1, 0, 0}, -w), 0.0f, 0.4f);
    scene.collide(make_plane({0, 0, 1}, 0), 0.0f, 0.4f).collide(make_plane({0, 0, -1}, -w), 0.0f, 0.4f);
    scene.dynamics.add(rods(pairs, 2 * r));
    scene.sleep();
    return scene;
}

TEST_CASE("a heap of dumbbells falls asleep, and then has the same bits from frame to frame", "[sleep]")
{
    Granular scene = dumbbells(128, 4);
    scene.run(360);
    CHECK(scene.last.asleep == 256);
    CHECK(fastest(scene) == 0);
    const PointSet rests = scene.points;
    scene.run(48);
    CHECK(same_bits(scene.points, rests));
}

TEST_CASE("islands that fall asleep and wake have the same bits on any number of threads", "[sleep][threads][slow]")
{
    const auto run = [](int threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                        static_cast<std::size_t>(threads));
        Granular scene = dumbbells(800, 12);
        while (scene.last.asleep < 50 && scene.options.frame < 120) scene.run(1);
        CHECK(scene.last.asleep >= 50);
        for (Vec3f& v : scene.points.v().write().first(400)) v = Vec3f(0, 0, 3);
        scene.run(12);
        CHECK(scene.last.asleep >= 50);
        CHECK(scene.last.asleep < 1600);
        return scene.points;
    };
    const PointSet one = run(1);
    CHECK(same_bits(one, run(2)));
    CHECK(same_bits(one, run(7)));
}

}  // namespace
}  // namespace rapid
