#include "runtime/solver/estimate/stiffness.h"

#include <fmt/format.h>

#include <cmath>

#include "tests/solver/scene.h"

namespace rapid {
namespace {

using namespace test;
using Catch::Matchers::Equals;

// A drag and a spring to the origin, which the integrator solves.
class LinearForce : public Force {
public:
    LinearForce(double k, double w2, double c = 0) : k_(k), w2_(w2), c_(c) { node = "linear1"; }
    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        for (std::size_t i = 0; i < chunk.size(); ++i) {
            forces.add_drag(i, k_, Vec3d(1, 0, 0));
            forces.add_spring(i, w2_, Vec3d::Zero());
            forces.add_quadratic_drag(i, c_);
        }
    }

private:
    double k_, w2_, c_;
};

std::vector<Stiffness> found_in(const Scene& scene) { return find_stiff(scene.points, scene.dynamics, scene.options); }

Scene with(double k, double w2, double c = 0)
{
    Scene scene(points({{1, 2, 0}}).v({{0, 3, 4}}));
    scene.dynamics.add(std::make_shared<LinearForce>(k, w2, c));
    return scene;
}

Scene pulled_by(double omega)
{
    Scene scene(points({{1, 0, 0}}).v({{0, 0, 0.5}}));
    scene.force([omega](const Chunk& chunk, std::size_t i) -> Vec3d { return -omega * omega * chunk.P[i]; });
    return scene;
}

}  // namespace

TEST_CASE("a drag is reported by its k dt, a spring by its omega dt, and both as exact", "[stiffness]")
{
    const int substeps = GENERATE(1, 4);
    const double dt = 1.0 / 24 / substeps;
    const auto drag = found_in(with(16 / dt, 1).substeps(substeps));
    REQUIRE(drag.size() == 1);
    CHECK(drag[0].kind == Stiffness::Drag);
    CHECK(drag[0].step == Approx(16));
    CHECK(text_of(drag[0]) == "linear1: k dt = 16; treated exactly");

    const auto spring = found_in(with(1, 2500 / dt / dt).substeps(substeps));
    REQUIRE(spring.size() == 1);
    CHECK(spring[0].kind == Stiffness::Spring);
    CHECK(text_of(spring[0]) == "linear1: omega dt = 50; treated exactly");
}

TEST_CASE("slow forces are not reported", "[stiffness]")
{
    CHECK(found_in(with(0.9 * 24, 0.8 * 24 * 24, 0.09 * 24)).empty());
    CHECK(found_in(pulled_by(0.49 * 24)).empty());
    CHECK(found_in(Scene(points({{1, 2, 0}})).gravity().floor()).empty());
    CHECK(found_in(Scene(points(std::vector<Vec3f>())).gravity()).empty());
}

TEST_CASE("an attraction is reported by its omega dt, with the errors of a frame by the closed form", "[stiffness]")
{
    const double omega = 1.9 * 24, h = 1.0 / 24;
    const auto found = found_in(pulled_by(omega));
    REQUIRE(found.size() == 1);
    CHECK(found[0].node == "push1");
    CHECK(found[0].kind == Stiffness::Oscillation);
    CHECK(found[0].step == Approx(1.9).epsilon(1e-6));
    REQUIRE(found[0].improvement);
    CHECK(found[0].improvement->substeps == 8);  // the first halving of 1.9 that falls below 1/4

    const Vec3d right(std::cos(omega * h), 0, 0.5 / omega * std::sin(omega * h));
    for (const auto& [substeps, error] :
         {std::pair(1, found[0].improvement->error), std::pair(8, found[0].improvement->error_after)}) {
        const Vec3d P = pulled_by(omega).substeps(substeps).run(1).P();
        CHECK(error == Approx((P - right).norm()).epsilon(0.05));
    }
    CHECK_THAT(text_of(found[0]), Equals(fmt::format("push1: omega dt = 1.9 at 1 sub-step; estimated error {:.1g} m; 8 "
                                                     "sub-steps would give {:.1g} m",
                                                     found[0].improvement->error, found[0].improvement->error_after)));
}

TEST_CASE("an orbit is reported by its angle per sub-step, of the nearest point", "[stiffness]")
{
    const double strength = 1000;
    Scene scene(points({{0.3f, 0, 0}, {0, 0, 0.1f}, {2, 0, 0}}).v({{0, 1, 0}, {0, 1, 0}, {0, 1, 0}}));
    scene.force([&](const Chunk& chunk, std::size_t i) -> Vec3d {
        return -strength / std::pow(chunk.P[i].norm(), 3) * chunk.P[i];
    });
    const auto found = found_in(scene);
    REQUIRE(found.size() == 1);
    CHECK(found[0].step == Approx(std::sqrt(strength / 1e-3) / 24).epsilon(1e-4));
}

TEST_CASE("a velocity-dependent force is reported by k dt where it damps and by omega dt where it turns", "[stiffness]")
{
    Scene slowed(points({{1, 0, 0}}).v({{1, 2, 3}}));
    slowed.force([](const Chunk& chunk, std::size_t i) -> Vec3d { return -36 * chunk.v[i]; });
    const auto decay = found_in(slowed);
    REQUIRE(decay.size() == 1);
    CHECK(decay[0].kind == Stiffness::Decay);
    CHECK(decay[0].step == Approx(1.5));
    CHECK_THAT(text_of(decay[0]), Catch::Matchers::StartsWith("push1: k dt = 1.5 at 1 sub-step; estimated error "));

    Scene turned(points({{1, 0, 0}}).v({{1, 2, 3}}));
    turned.force([](const Chunk& chunk, std::size_t i) -> Vec3d { return Vec3d(0, 36, 0).cross(chunk.v[i]); });
    const auto turning = found_in(turned);
    REQUIRE(turning.size() == 1);
    CHECK(turning[0].kind == Stiffness::Oscillation);
    CHECK(turning[0].step == Approx(1.5));
}

TEST_CASE("quadratic drag is reported by its c v dt", "[stiffness]")
{
    const auto found = found_in(with(0, 0, 48));  // at 5 m/s
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == Stiffness::SquaredDrag);
    CHECK_THAT(text_of(found[0]), Catch::Matchers::StartsWith("linear1: c v dt = 10 at 1 sub-step; estimated error "));
}

TEST_CASE("only the points that a force acts on are sampled, each with its own time step", "[stiffness]")
{
    PointSet set = points({{1, 0, 0}, {1, 0, 0}, {1, 0, 0}})
                       .set<float>("dt", {0, 0.01f, 0.04f})  // the first is born at the frame's end
                       .group("held", {0, 1});
    Scene scene(set);
    auto force = std::make_shared<LinearForce>(500, 0);
    scene.dynamics.add(force);
    CHECK(found_in(scene).at(0).step == Approx(20));
    force->group = "held";
    CHECK(found_in(scene).at(0).step == Approx(5));
    force->group = "nobody";
    CHECK(found_in(scene).empty());
    force->group = "";
    scene.options.group = "held";
    CHECK(found_in(scene).at(0).step == Approx(5));
}

TEST_CASE("the examination of stiffness changes no point", "[stiffness]")
{
    Scene scene = pulled_by(1000);
    const PointSet before = scene.points;
    found_in(scene);
    CHECK(scene.points.P()[0] == before.P()[0]);
    CHECK(scene.points.v()[0] == before.v()[0]);
}

TEST_CASE("the worst result of a node is kept, separately for exact and inexact parts", "[stiffness]")
{
    Stiffness drag, later, turning;
    drag.node = later.node = turning.node = "a";
    drag.step = 3;
    later.step = 5;
    later.frame = 7;
    turning.kind = Stiffness::Oscillation;
    turning.step = 0.7;
    std::vector<Stiffness> worst;
    keep_worst(worst, {drag, turning});
    keep_worst(worst, {later});
    keep_worst(worst, {drag});
    REQUIRE(worst.size() == 2);
    CHECK(worst[0].frame == 7);
    CHECK(worst[1].step == 0.7);
}

}  // namespace rapid
