// SearchedPlaces: what is not outrun has been found, and what moves together is not looked for again.
#include "runtime/solver/constraints/neighbour_list.h"

#include <random>

#include "tests/test.h"

namespace rapid {
namespace {

// Points of one kind of motion, and which of them a search has found.
struct Swarm {
    std::vector<Place> at;
    std::vector<Vec3d> v;
    std::vector<float> radius;
    SearchedPlaces searched;
    std::vector<std::pair<std::size_t, std::size_t>> unfound;

    Substep now()
    {
        Substep now;
        now.at = at;
        now.v = v;
        now.dt = 1e-3;
        return now;
    }
    void search()
    {
        const auto [least, largest] = std::minmax_element(radius.begin(), radius.end());
        searched.set(now(), radius, *largest, *least);
        unfound.clear();
        for (std::size_t i = 0; i < at.size(); ++i)
            for (std::size_t j = 0; j < i; ++j)
                if ((at[i].P - at[j].P).norm() >= double(searched.reach()[i]) + double(searched.reach()[j]))
                    unfound.emplace_back(i, j);
    }
    bool misses_one() const
    {
        return std::any_of(unfound.begin(), unfound.end(), [&](const auto& pair) {
            const auto [i, j] = pair;
            return (at[i].P - at[j].P).norm() < double(radius[i]) + double(radius[j]);
        });
    }
};

TEST_CASE("points that have not outrun their search touch none that it has not found", "[contacts]")
{
    const float largest = GENERATE(0.02f, 0.3f);    // m; the least is 0.02
    const double wild = GENERATE(0.0, 3.0, 100.0);  // m/s, besides what they do together
    CAPTURE(largest, wild);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> in(-1, 1);
    Swarm swarm;
    for (int k = 0; k < 400; ++k) {
        swarm.at.push_back({Vec3d(in(random), in(random), in(random)), 1});
        swarm.radius.push_back(k % 20 == 0 ? largest : 0.02f);
        // A fall, a shear and a spin; and each its own way.
        const Vec3d& P = swarm.at.back().P;
        swarm.v.push_back(Vec3d(4 * P.y(), -20 - 3 * P.x(), 0) + wild * Vec3d(in(random), in(random), in(random)));
    }
    swarm.search();
    int searches = 1;
    for (int step = 0; step < 100; ++step) {
        for (std::size_t i = 0; i < swarm.at.size(); ++i) swarm.at[i].P += 1e-3 * swarm.v[i];
        if (swarm.searched.outrun(swarm.now())) swarm.search(), ++searches;
        REQUIRE_FALSE(swarm.misses_one());
    }
    CHECK(searches > (wild > 0 ? 5 : 1));
}

TEST_CASE("points that fall together need no new search, whatever others do far away", "[contacts]")
{
    Swarm swarm;
    for (int cluster = 0; cluster < 2; ++cluster)
        for (int k = 0; k < 50; ++k) {
            swarm.at.push_back({Vec3d(0.03 * k, 10.0 * cluster, 0), 1});
            swarm.v.push_back(Vec3d(0, cluster, 0));  // apart, at 1 m/s
            swarm.radius.push_back(0.02f);
        }
    swarm.search();
    for (int step = 0; step < 50; ++step) {
        for (std::size_t i = 0; i < swarm.at.size(); ++i) swarm.at[i].P += 1e-3 * swarm.v[i];
        CHECK_FALSE(swarm.searched.outrun(swarm.now()));
    }
}

TEST_CASE("a point that is put elsewhere is looked for there", "[contacts]")
{
    Swarm swarm;
    for (int k = 0; k < 100; ++k) {
        swarm.at.push_back({Vec3d(0.05 * k, 0, 0), 1});
        swarm.v.push_back(Vec3d::Zero());
        swarm.radius.push_back(0.02f);
    }
    swarm.search();
    CHECK_FALSE(swarm.searched.outrun(swarm.now()));
    swarm.at[0].P = swarm.at[99].P;
    CHECK(swarm.searched.outrun(swarm.now()));
}

}  // namespace
}  // namespace rapid
