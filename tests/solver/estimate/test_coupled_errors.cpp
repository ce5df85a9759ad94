#include "runtime/solver/estimate/coupled_errors.h"

#include <algorithm>
#include <numeric>

#include "tests/solver/constraints/granular.h"
#include "tests/solver/constraints/rods.h"

using namespace rapid;
using namespace rapid::test;

namespace {

PointSet row_of(std::size_t n, float spacing)
{
    PointSet points;
    points.append(n);
    const auto ids = points.id().write();
    std::iota(ids.begin(), ids.end(), 0);
    const auto P = points.P().write();
    for (std::size_t i = 0; i < n; ++i) P[i] = {spacing * static_cast<float>(i), 0.02f * (i % 2), 0};
    return points;
}

// A chain whose first point is turned around the others, and falls.
Scene falling_chain(int substeps)
{
    Scene scene(row_of(6, 0.1f));
    scene.points.v().write()[0] = {0, 3, 1};
    scene.gravity().substeps(substeps);
    scene.dynamics.add(rods(links_of_chain(5), 0.1));
    return scene;
}

// Balls in a row pressed onto a floor: their memory determines the next frame.
struct Pile {
    ShapeLoads loads;
    Scene scene;

    Pile(std::size_t n, int substeps) : scene(row_of(n, 0.09f))
    {
        auto balls = std::make_shared<Spheres>();
        balls->node = "contact1";
        balls->options.radius = 0.05f;
        balls->options.friction = 0.3f;
        scene.gravity().floor(0, 0.3f).substeps(substeps);
        scene.dynamics.add(balls);
        scene.options.loads = &loads;
    }
};

CoupledErrors::Errors errors_of_frame(CoupledErrors& errors, Scene& scene)
{
    errors.begin(scene.points, scene.dynamics, scene.options);
    scene.run(1);
    return errors.end(scene.points);
}

std::vector<double> twice_the_distances(const Scene& a, const Scene& b)
{
    std::vector<double> result;
    for (std::size_t i = 0; i < a.points.size(); ++i) result.push_back(2 * (a.P(i) - b.P(i)).norm());
    return result;
}

}  // namespace

TEST_CASE("the error of coupled points is twice their distance from a run of twice the sub-steps", "[coupled errors]")
{
    CoupledErrors of_chain, of_pile;
    Scene coarse = falling_chain(4), fine = falling_chain(8);
    Pile pile(20, 4), finer(20, 8);
    for (int f = 0; f < 20; ++f) {
        const std::vector<double> chain_errors = errors_of_frame(of_chain, coarse).since_birth;
        CHECK(chain_errors == twice_the_distances(coarse, fine.run(1)));
        const std::vector<double> pile_errors = errors_of_frame(of_pile, pile.scene).since_birth;
        CHECK(pile_errors == twice_the_distances(pile.scene, finer.scene.run(1)));
    }
    CHECK(of_chain.end(coarse.points).unknown.empty());
}

TEST_CASE("an estimate changes nothing of the points and of what their constraints remember", "[coupled errors]")
{
    CoupledErrors errors;
    Pile with(50, 3), without(50, 3);
    for (int f = 0; f < 30; ++f) errors_of_frame(errors, with.scene);
    without.scene.run(30);
    CHECK(same_bits(with.scene.points, without.scene.points));
}

TEST_CASE("changes by nodes, births and deaths are those of the shadows, too", "[coupled errors]")
{
    CoupledErrors errors;
    Scene coarse = falling_chain(4), fine = falling_chain(8);
    const auto both = [&](const auto& change) { change(coarse.points), change(fine.points); };
    for (int f = 0; f < 12; ++f) {
        both([&](PointSet& points) {
            for (Vec3f& v : points.v().write()) v += Vec3f(0, 0, 0.25f);
            if (f == 4) {  // one point is removed, and an unconnected one is added
                std::vector<std::uint8_t> keep(points.size(), 1);
                keep[2] = 0;
                points.keep(keep);
            }
            if (f == 6) {
                points.append(1);
                points.id().write()[5] = 77;
            }
        });
        const std::vector<double> found = errors_of_frame(errors, coarse).since_birth,
                                  expected = twice_the_distances(coarse, fine.run(1));
        REQUIRE(found.size() == expected.size());
        // Velocities are sometimes added in single precision.
        for (std::size_t i = 0; i < found.size(); ++i) CHECK(found[i] == Approx(expected[i]).margin(1e-5));
        CHECK(*std::max_element(found.begin(), found.end()) > (f < 1 ? 0 : 1e-4));
    }
}

TEST_CASE("of too many points the errors of the frames 1, 2, 4, 8, ... and 40 are told", "[coupled errors]")
{
    CoupledErrors errors;
    Pile pile(CoupledErrors::max_points + 1, 2);
    for (int f = 0; f < 42; ++f) {
        const bool is_due = f < 2 || f == 3 || f == 7 || f == 15 || f == 31 || f == 39;
        const CoupledErrors::Errors found = errors_of_frame(errors, pile.scene);
        CHECK(found.since_birth.empty());
        CHECK_THAT(found.unknown, Catch::Contains("more than 1,000 points act on one another"));
        REQUIRE(found.of_frame.size() == (is_due ? pile.scene.points.size() : 0));
        if (f > 0) continue;
        Pile other(CoupledErrors::max_points + 1, 4);
        CHECK(found.of_frame == twice_the_distances(pile.scene, other.scene.run(1)));
    }
}

TEST_CASE("the error of one frame is that of all of its sub-frames", "[coupled errors]")
{
    CoupledErrors errors;
    Pile pile(CoupledErrors::max_points + 1, 1), fine(CoupledErrors::max_points + 1, 2);
    for (int step = 0; step < 9; ++step) {
        pile.scene.options.begins_frame = step % 3 == 0;  // the third frame is not due
        const CoupledErrors::Errors found = errors_of_frame(errors, pile.scene);
        fine.scene.run(1);
        if (step < 3) CHECK(found.of_frame == twice_the_distances(pile.scene, fine.scene));
        CHECK(found.of_frame.empty() == (step >= 6));
    }
}

TEST_CASE("what can't be solved a second time is named", "[coupled errors]")
{
    struct WithoutTwin : RowsConstraint<Rod> {
        std::shared_ptr<const Constraint> twin(const Constraint*) const override { return nullptr; }
    };
    Scene scene(row_of(3, 0.1f));
    const auto links = std::make_shared<WithoutTwin>();
    links->node = "links1";
    links->rows->add({0, 1}, {0.1}, 0);
    scene.dynamics.add(links);
    CoupledErrors errors;
    const CoupledErrors::Errors found = errors_of_frame(errors, scene);
    CHECK(found.since_birth.empty());
    CHECK(found.of_frame.empty());
    CHECK_THAT(found.unknown, Catch::Contains("\"links1\""));
}
