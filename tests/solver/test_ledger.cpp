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

TEST_CASE("a spring holds what it is stretched by", "[ledger]")
{
    const double compliance = 0.01;
    Scene scene(points({{0, 0, 0}, {1.5f, 0, 0}}).set<float>("mass", {1, 1}));
    scene.dynamics.add(rods({{0, 1}}, 1, compliance));
    scene.substeps(64).run(1);
    const double stretch = (scene.P(0) - scene.P(1)).norm() - 1;
    CHECK(scene.last.ledger->elastic == Approx(0.5 * stretch * stretch / compliance).epsilon(1e-4));
    CHECK(scene.last.ledger->energy() == Approx(0.5 * 0.25 / compliance).epsilon(1e-3));
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
