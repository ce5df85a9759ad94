// The ledger of constrained points against closed forms.
#include "runtime/solver/ledger.h"

#include "tests/solver/constraints/granular.h"
#include "tests/solver/constraints/rods.h"

namespace rapid {
namespace {

using test::Granular;
using test::immovable;
using test::points;
using test::rods;
using test::Scene;

TEST_CASE("a contact without bounce takes the energy of the relative motion, and no momentum", "[ledger]")
{
    Granular scene(points({{0, 0, 0}, {0.25f, 0, 0}})
                       .v({{3, 0, 0}, {-1, 0, 0}})
                       .set<float>("pscale", {0.1f, 0.1f})
                       .set<float>("mass", {1, 3}));
    scene.substeps(4).run(1);
    REQUIRE(scene.last.ledger);
    const Ledger& ledger = *scene.last.ledger;
    CHECK(ledger.kinetic == Approx(0).margin(1e-9));
    CHECK(ledger.by.contacts == Approx(-0.5 * 0.75 * 16));
    CHECK(ledger.by.rods == 0);
    CHECK(ledger.by_motion == Approx(0).margin(1e-9));
    REQUIRE(ledger.residue);
    CHECK(ledger.residue->is_rounding());
    CHECK(ledger.momentum.norm() <= 1e-5);
}

TEST_CASE("points that fall together have no residue, and gravity's energy", "[ledger]")
{
    Scene scene(points({{1, 2, 0}, {2, 2, 1}}).v({{0, 1, 0}, {2, 1, -1}}).set<float>("mass", {1, 3}));
    scene.gravity().dynamics.add(rods({{0, 1}}, std::sqrt(2.0)));
    scene.substeps(8).run(1);
    REQUIRE(scene.last.ledger);
    const Ledger& ledger = *scene.last.ledger;
    double potential = 0;
    for (const std::size_t i : {0, 1}) potential += (i ? 3 : 1) * 9.81 * scene.P(i).y();
    CHECK(ledger.potential == Approx(potential));
    REQUIRE(ledger.residue);
    CHECK(ledger.residue->is_rounding());
    CHECK(ledger.residue->angular_momentum <= 1e-5);
}

TEST_CASE("a spring stores the energy of its stretch", "[ledger]")
{
    const double compliance = 0.01;
    Scene scene(points({{0, 0, 0}, {1.5f, 0, 0}}).set<float>("mass", {1, 1}));
    scene.dynamics.add(rods({{0, 1}}, 1, compliance));
    scene.substeps(64).run(1);
    const double stretch = (scene.P(0) - scene.P(1)).norm() - 1;
    CHECK(scene.last.ledger->elastic == Approx(0.5 * stretch * stretch / compliance).epsilon(1e-4));
    const Ledger& ledger = *scene.last.ledger;
    CHECK(ledger.kinetic + ledger.potential + ledger.elastic == Approx(0.5 * 0.25 / compliance).epsilon(1e-3));
}

TEST_CASE("the residue is what the frame has changed beside gravity and what is told, of what is in motion", "[ledger]")
{
    // 2 kg that fall for 0.1 s from 5 m, from a velocity of 1 m/s along x.
    const Vec3d g(0, -10, 0);
    const double h = 0.1;
    LedgerState before, after;
    before.mass = after.mass = 2;
    before.center = 2 * Vec3d(0, 5, 0);
    before.momentum = 2 * Vec3d(1, 0, 0);
    before.speed = 2;
    before.kinetic = 0.5 * 2;
    before.potential = 2 * 10 * 5;
    const Vec3d P(0.1, 4.95, 0), v(1, -1, 0);
    after.center = 2 * P;
    after.momentum = 2 * v;
    after.speed = 2 * v.norm();
    after.kinetic = 2;
    after.potential = 2 * 10 * P.y();
    before.angular_momentum = 2 * Vec3d(0, 5, 0).cross(Vec3d(1, 0, 0));
    after.angular_momentum = 2 * P.cross(v);
    before.turning = after.turning = 1;

    const auto residue = [&](const EnergyChanges& by) { return *ledger_of(before, after, by, true, g, h).residue; };
    CHECK(residue({}).is_rounding());
    CHECK(residue({}).angular_momentum < 1e-15);
    CHECK_FALSE(ledger_of(before, after, {}, false, g, h).residue);

    after.kinetic += 0.5;
    CHECK_FALSE(residue({}).is_rounding());
    CHECK(residue({}).energy == Approx(0.5 / (2.5 + 1)));  // of the kinetic energy, plus the energy from gravity
    EnergyChanges reported;
    reported.contacts = 0.5;
    CHECK(residue(reported).is_rounding());
    after.kinetic -= 1;  // breaking rows remove energy
    CHECK(residue({}).is_rounding());

    after.momentum += Vec3d(0, 0, 1e-3);
    CHECK_FALSE(residue({}).is_rounding());
    CHECK(residue({}).momentum == Approx(1e-3 / (2 * std::sqrt(2.0) + 2)));
    after.angular_momentum += Vec3d(0, 0, 1e-3);
    CHECK(residue({}).angular_momentum > 1e-5);
}

TEST_CASE("what rounding leaves of points that are parted at rest is no residue, whatever their masses", "[ledger]")
{
    Granular scene(points({{-0.0669165f, 0, 0}, {0, 0.020075f, 0}})
                       .set<float>("pscale", {0.009f, 0.076f})
                       .set<float>("mass", {1.8e-4f, 1.8e4f}));
    for (int frame = 0; frame < 4; ++frame) {
        scene.run(1);
        REQUIRE(scene.last.ledger->residue);
        CHECK(scene.last.ledger->residue->is_rounding());
    }
}

TEST_CASE("there is no residue where something else holds points, and no ledger without constraints", "[ledger]")
{
    Scene held(points({{0, 0, 0}, {1, 0, 0}}).set<float>("mass", {immovable, 1}));
    held.gravity().dynamics.add(rods({{0, 1}}, 1));
    held.run(1);
    REQUIRE(held.last.ledger);
    CHECK(!held.last.ledger->residue);

    Scene free(points({{0, 0, 0}}));
    free.gravity().run(1);
    CHECK(!free.last.ledger);
}

}  // namespace
}  // namespace rapid
