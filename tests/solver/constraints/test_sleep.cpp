// Sleep: piles at rest are bit-identical between frames; points that are hit, pushed, moved or unsupported wake and
// then move as if they had never slept.
#include "runtime/solver/constraints/sleep.h"

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
constexpr float r = 0.05f;

// n spheres that fall from a loose lattice into a box with the floor's friction.
class Box : public Granular {
public:
    explicit Box(std::size_t n, unsigned seed = 1) : Granular(lattice(n, seed), 0, 0.4f)
    {
        gravity().floor(0, 0.4f).substeps(12);
        const double w = side * 2.2 * r;
        collide(make_plane({1, 0, 0}, 0), 0.0f, 0.4f).collide(make_plane({-1, 0, 0}, -w), 0.0f, 0.4f);
        collide(make_plane({0, 0, 1}, 0), 0.0f, 0.4f).collide(make_plane({0, 0, -1}, -w), 0.0f, 0.4f);
        sleep();
    }

    double energy() const  // J, for points of 1 kg
    {
        double sum = 0;
        for (std::size_t i = 0; i < points.size(); ++i) sum += 0.5 * v(i).squaredNorm() + g * P(i).y();
        return sum;
    }

private:
    static constexpr std::size_t side = 6;

    static PointSet lattice(std::size_t n, unsigned seed)
    {
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> off(-0.05f * r, 0.05f * r);
        std::vector<Vec3f> at;
        for (std::size_t i = 0; i < n; ++i)
            at.emplace_back(2.2f * r * (static_cast<float>(i % side) + 0.5f) + off(random),
                            2.2f * r * (static_cast<float>(i / side / side) + 0.5f) + off(random),
                            2.2f * r * (static_cast<float>(i / side % side) + 0.5f) + off(random));
        return test::points(at).set<float>("pscale", std::vector<float>(n, r));
    }
};

// Points of radius r on the floor, after being at rest long enough to sleep.
Granular asleep_on_floor(const std::vector<Vec3f>& at, float bounce = 0, float friction = 0)
{
    Granular scene(points(at).set<float>("pscale", std::vector<float>(at.size(), r)), bounce, friction);
    scene.gravity().floor(0, friction).substeps(8);
    return scene;
}

TEST_CASE("a pile at rest sleeps: the same bits from frame to frame, and no more energy than before", "[sleep]")
{
    Box box(400);
    box.run(24);
    double before = box.energy();
    for (int second = 0; second < 9; ++second) {
        box.run(24);
        const double now = box.energy();
        CHECK(now <= before * (1 + 1e-5));
        before = now;
    }
    CHECK(box.last.asleep == 400);
    const PointSet rests = box.points;
    box.run(100);
    CHECK(same_bits(box.points, rests));
    CHECK(box.last.asleep == 400);
    CHECK(box.last.constraint_rows > 400);  // sleeping rows are counted, too
    CHECK(box.deepest() == Approx(box.last.constraint_residual_max).margin(1e-6));
    CHECK(box.deepest() < 0.06 * r);
}

TEST_CASE("most piles sleep six seconds after their fall, and all after ten", "[sleep][slow]")
{
    int early = 0;
    for (unsigned seed = 1; seed <= 15; ++seed) {
        Box box(400, seed);
        box.run(144);
        early += box.last.asleep == 400;
        box.run(96);
        CHECK(box.last.asleep == 400);
    }
    CHECK(early >= 8);
}

TEST_CASE("piles that fall asleep and are woken have the same bits on any number of threads", "[sleep][threads][long]")
{
    const auto run = [](int threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                        static_cast<std::size_t>(threads));
        Box box(6000);
        box.run(60);
        CHECK(box.last.asleep > 100);
        CHECK(box.last.asleep < 6000);
        return box.points;
    };
    const PointSet one = run(1);
    CHECK(same_bits(one, run(2)));
    CHECK(same_bits(one, run(5)));
}

TEST_CASE("the column alone decides who sleeps: records may be lost", "[sleep]")
{
    Box box(200);
    box.run(120);
    REQUIRE(box.last.asleep == 200);
    Box again(200);
    again.points = box.points;
    again.run(24);
    CHECK(same_bits(again.points, box.points));
    CHECK(again.last.asleep == 200);
}

TEST_CASE("a sleeper that is hit head on takes the velocity, as an awake point does", "[sleep]")
{
    const float bounce = GENERATE(0.0f, 1.0f);
    Granular scene = asleep_on_floor({{0, r, 0}, {0.5f, r, 0}}, bounce);
    scene.sleep().run(12);
    REQUIRE(scene.last.asleep == 2);
    scene.points.v().write()[0] = Vec3f(2, 0, 0);
    scene.run(12);
    CHECK_THAT(scene.v(0), close_to(Vec3d(1.0 - bounce, 0, 0), 1e-3));
    CHECK_THAT(scene.v(1), close_to(Vec3d(1.0 + bounce, 0, 0), 1e-3));
}

TEST_CASE("a shock wakes all points that it reaches: a sleeping cluster takes all of the momentum", "[sleep]")
{
    std::vector<Vec3f> at{{-0.5f, r, 0}};
    for (int k = 0; k < 6; ++k) at.emplace_back(2 * r * static_cast<float>(k), r, 0.0f);
    Granular scene = asleep_on_floor(at);
    const std::vector<float> mass{50, 1, 1, 1, 1, 1, 1};
    const bool sleeps = GENERATE(false, true);
    CAPTURE(sleeps);
    scene.points.set("mass", Column<float>(std::span(mass)));
    if (sleeps) scene.sleep();
    scene.run(12);
    REQUIRE(scene.last.asleep == (sleeps ? at.size() : 0));
    scene.points.v().write()[0] = Vec3f(3, 0, 0);
    scene.run(10);
    CHECK(scene.momentum().x() == Approx(150).epsilon(0.02));
    CHECK(scene.v(0).x() == Approx(2.5).epsilon(0.02));  // 150/56 if all stay together: the others fly off
}

TEST_CASE("a sleeper that loses its support falls", "[sleep]")
{
    SECTION("a point under it")
    {
        Granular scene = asleep_on_floor({{0, r, 0}, {0, 3 * r, 0}});
        scene.sleep().run(12);
        REQUIRE(scene.last.asleep == 2);
        scene.points.keep(std::vector<std::uint8_t>{0, 1});
        scene.run(1);
        CHECK(scene.v().y() == Approx(-g / 24).epsilon(1e-4));
    }
    SECTION("a shape under it")
    {
        Granular scene = asleep_on_floor({{0, r, 0}});
        scene.sleep().run(12);
        REQUIRE(scene.last.asleep == 1);
        Dynamics without;
        scene.dynamics.visit_in_order([&]<class T>(const std::shared_ptr<const T>& dynamic) {
            if constexpr (!std::is_same_v<T, Collider>) without.add(dynamic);
        });
        scene.dynamics = without;
        scene.run(1);
        CHECK(scene.v().y() == Approx(-g / 24).epsilon(1e-4));
    }
    SECTION("a neighbour that is moved away")
    {
        Granular scene = asleep_on_floor({{0, r, 0}, {0, 3 * r, 0}});
        scene.sleep().run(12);
        REQUIRE(scene.last.asleep == 2);
        scene.points.P().write()[0] = Vec3f(1, r, 0);
        scene.run(2);
        CHECK(scene.v(1).y() < -g / 24);
    }
}

TEST_CASE("a sleeper wakes when forces change, and moves by them", "[sleep]")
{
    double push = 0;
    Granular scene = asleep_on_floor({{0, r, 0}});
    scene.force([&](const Chunk&, std::size_t) { return Vec3d(push, 0, 0); });
    scene.sleep().run(12);
    REQUIRE(scene.last.asleep == 1);
    push = 0.005;  // half a thousandth of its weight: it continues to sleep
    scene.run(1);
    CHECK(scene.v().norm() == 0);
    push = 0.5;    // a twentieth, without friction
    scene.run(1);  // all except the first of 8 substeps
    CHECK(scene.v().x() == Approx(0.5 / 24 * 7 / 8).epsilon(1e-4));
    push = 4;
    scene.run(1);
    CHECK(scene.v().x() == Approx(0.5 / 24 * 7 / 8 + 4.0 / 24).epsilon(1e-4));
}

TEST_CASE("a sleeper that a node moves, or gives a velocity, wakes", "[sleep]")
{
    Granular scene = asleep_on_floor({{0, r, 0}, {1, r, 0}});
    scene.sleep().run(12);
    REQUIRE(scene.last.asleep == 2);
    scene.points.v().write()[0] = Vec3f(1, 0, 0);
    scene.points.P().write()[1] = Vec3f(1, 1, 0);
    scene.run(1);
    CHECK(scene.P(0).x() == Approx(1.0 / 24).epsilon(1e-5));
    CHECK(scene.v(1).y() == Approx(-g / 24).epsilon(1e-5));
}

TEST_CASE("a sleeper on a slope slides when the slope loses its friction", "[sleep]")
{
    const double angle = 0.3;
    const Vec3d n(std::sin(angle), std::cos(angle), 0);
    Granular scene(points({(double(r) * n).cast<float>()}).set<float>("pscale", {r}));
    scene.gravity().collide(make_plane(n, 0), 0.0f, 0.5f).substeps(8);
    scene.sleep().run(12);
    REQUIRE(scene.last.asleep == 1);
    auto smooth = std::make_shared<Collider>(*scene.dynamics.colliders().back());
    smooth->friction = 0.0f;
    scene.dynamics.replace_collider(0, smooth);
    scene.run(1);
    CHECK(scene.v().norm() == Approx(g * std::sin(angle) / 24).epsilon(1e-4));
}

TEST_CASE("a point that slides slowly, or that no force acts on, does not fall asleep", "[sleep]")
{
    Granular slides = asleep_on_floor({{0, r, 0}});
    slides.points.v().write()[0] = Vec3f(0.01f, 0, 0);
    slides.sleep().run(48);
    CHECK(slides.last.asleep == 0);
    CHECK(slides.P().x() == Approx(0.02).epsilon(1e-4));

    Granular floats(points({{0, 0, 0}, {2 * r, 0, 0}}).set<float>("pscale", {r, r}));
    floats.substeps(4);
    floats.sleep().run(48);
    CHECK(floats.last.asleep == 0);
}

TEST_CASE("a sleeper wakes under a larger load, and supports it", "[sleep]")
{
    Granular scene = asleep_on_floor({{0, r, 0}});
    scene.sleep().run(12);
    REQUIRE(scene.last.asleep == 1);
    // Another is placed on it, a little to the side: both roll apart and come to rest on the floor.
    scene.points.append(1);
    scene.points.id().write()[1] = 1;
    scene.points.P().write()[1] = Vec3f(0.2f * r, 2.9f * r, 0);
    scene.points.column<float>("pscale").write()[1] = r;
    scene.run(36);
    CHECK(scene.P(1).y() == Approx(r).epsilon(1e-3));
    CHECK(scene.P(0).x() < -0.1 * r);
}

}  // namespace
}  // namespace rapid
