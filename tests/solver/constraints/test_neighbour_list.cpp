// NeighbourList and StrayPairs: together they miss no contact while the list is valid, and a common motion creates no
// strays.
#include "runtime/solver/constraints/neighbour_list.h"

#include <random>

#include "tests/test.h"

namespace rapid {
namespace {

// Moving points, and the pairs that a search has not listed.
struct Swarm {
    std::vector<ProjectedPoint> at;
    std::vector<Vec3d> v;
    std::vector<float> radius;
    NeighbourList list;
    StrayPairs strays;
    std::vector<std::pair<std::size_t, std::size_t>> unlisted;

    Substep step()
    {
        Substep step;
        step.points = at;
        step.v = v;
        step.dt = 1e-3;
        return step;
    }
    void search()
    {
        list.build(step(), radius, RadiusGrids({radius.data(), 1}, radius.size(), 0.1, 8));
        unlisted.clear();
        for (std::size_t i = 0; i < at.size(); ++i)
            for (std::size_t j = 0; j < i; ++j)
                if ((at[i].P - at[j].P).norm() >= double(list.reach()[i]) + double(list.reach()[j]))
                    unlisted.emplace_back(i, j);
    }
    bool misses_one()
    {
        const std::vector<ContactPair>& found = strays.find(step(), radius, list);
        return std::any_of(unlisted.begin(), unlisted.end(), [&](const auto& pair) {
            const auto [i, j] = pair;
            return (at[i].P - at[j].P).norm() < double(radius[i]) + double(radius[j]) &&
                   !std::binary_search(found.begin(), found.end(), ContactPair{std::uint32_t(j), std::uint32_t(i)});
        });
    }
};

TEST_CASE("no points touch that a valid list does not hold", "[contacts]")
{
    const float largest = GENERATE(0.02f, 0.3f);    // m; the smallest is 0.02
    const double wild = GENERATE(0.0, 3.0, 100.0);  // m/s, in addition to the common motion
    CAPTURE(largest, wild);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> in(-1, 1);
    Swarm swarm;
    for (int k = 0; k < 400; ++k) {
        swarm.at.push_back({Vec3d(in(random), in(random), in(random)), 1});
        swarm.radius.push_back(k % 20 == 0 ? largest : 0.02f);
        // A fall, a shear and a spin, plus an individual motion.
        const Vec3d& P = swarm.at.back().P;
        swarm.v.push_back(Vec3d(4 * P.y(), -20 - 3 * P.x(), 0) + wild * Vec3d(in(random), in(random), in(random)));
    }
    swarm.search();
    int searches = 1;
    for (int k = 0; k < 100; ++k) {
        for (std::size_t i = 0; i < swarm.at.size(); ++i) swarm.at[i].P += 1e-3 * swarm.v[i];
        if (swarm.list.expired(swarm.step())) swarm.search(), ++searches;
        REQUIRE_FALSE(swarm.misses_one());
    }
    CHECK(searches > (wild > 0 ? 5 : 1));
}

TEST_CASE("a common motion does not expire the list, whatever others do far away", "[contacts]")
{
    Swarm swarm;
    for (int cluster = 0; cluster < 2; ++cluster)
        for (int k = 0; k < 50; ++k) {
            swarm.at.push_back({Vec3d(0.03 * k, 10.0 * cluster, 0), 1});
            swarm.v.push_back(Vec3d(0, cluster, 0));  // apart, at 1 m/s
            swarm.radius.push_back(0.02f);
        }
    swarm.search();
    for (int k = 0; k < 50; ++k) {
        for (std::size_t i = 0; i < swarm.at.size(); ++i) swarm.at[i].P += 1e-3 * swarm.v[i];
        CHECK_FALSE(swarm.list.expired(swarm.step()));
    }
}

TEST_CASE("of a few points that stray the pairs are found apart, of many the list expires", "[contacts]")
{
    // A lattice with points out of reach of each other; in some rows the first and the third point approach the
    // second.
    const std::uint32_t side = 12, rows = GENERATE(0u, 1u, 17u, 18u);  // two strays each, of 1,728 points
    CAPTURE(rows);
    Swarm swarm;
    for (std::uint32_t i = 0; i < side * side * side; ++i) {
        swarm.at.push_back({0.052 * Vec3d(i % side, i / side % side, i / side / side), 1});
        swarm.v.push_back(Vec3d::Zero());
        swarm.radius.push_back(0.02f);
    }
    swarm.search();
    REQUIRE(swarm.list.pairs().size() == 0);
    std::vector<ContactPair> expected;
    for (std::uint32_t row = 0; row < rows; ++row) {
        const std::uint32_t i = row * side;
        swarm.at[i].P.x() += 0.035;
        swarm.at[i + 2].P.x() -= 0.035;
        for (const ContactPair& pair : {ContactPair{i, i + 1}, ContactPair{i, i + 2}, ContactPair{i + 1, i + 2}})
            expected.push_back(pair);
    }
    REQUIRE(swarm.list.expired(swarm.step()) == (rows > 17));
    if (rows > 17) return;
    CHECK(swarm.list.strays().size() == 2 * rows);
    CHECK(swarm.strays.find(swarm.step(), swarm.radius, swarm.list) == expected);
}

}  // namespace
}  // namespace rapid
