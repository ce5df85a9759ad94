#include "runtime/solver/constraints/contact_search.h"

#include <numeric>
#include <random>

#include "tests/test.h"

namespace rapid {
namespace {

// Spheres of one or two sizes, the large ones first, in a grid for each size.
struct Spheres {
    std::vector<Vec3d> at;
    std::vector<float> reach;
    std::vector<CellGrid> grids;

    void add(std::size_t count, double scatter, float size, unsigned seed)
    {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> in(-scatter, scatter);
        for (std::size_t k = 0; k < count; ++k) at.emplace_back(in(random), in(random), in(random));
        reach.insert(reach.end(), count, size);
    }
    SpheresView view() const { return {at, {reach.data(), 1}, Vec3d::Zero()}; }

    void sort_into_grids()
    {
        std::vector<float> sizes = reach;
        sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
        for (const float size : sizes) {
            std::vector<std::uint32_t> members(at.size());
            std::iota(members.begin(), members.end(), 0u);
            std::erase_if(members, [&](std::uint32_t i) { return reach[i] != size; });
            grids.emplace_back().width = 2.0 * size;
            CellSorter().fill(grids.back(), view(), members);
        }
    }
    double pairs() const
    {
        std::size_t found = 0;
        for (std::size_t i = 0; i < at.size(); ++i)
            for (std::size_t j = 0; j < i; ++j) found += (at[i] - at[j]).norm() < double(reach[i]) + double(reach[j]);
        return static_cast<double>(found);
    }
};

void check_estimate(Spheres spheres, double factor)
{
    spheres.sort_into_grids();
    const double pairs = spheres.pairs(), reported = estimate_pairs(spheres.grids, spheres.view());
    CAPTURE(pairs, reported);
    CHECK(pairs > 1000);
    CHECK(reported < factor * pairs);
    CHECK(reported > pairs / factor);
    CHECK(max_pairs(spheres.grids) >= pairs);
}

}  // namespace

TEST_CASE("the number of pairs is estimated before the search, for evenly and unevenly spread points", "[contacts]")
{
    const double scatter = GENERATE(0.001, 0.1, 1, 2);
    CAPTURE(scatter);
    Spheres even;
    even.add(4000, scatter, 0.1f, 1);
    check_estimate(std::move(even), 1.3);

    Spheres clump;  // nearly all pairs are among one point in thirty
    clump.add(3000, 5, 0.05f, 2);
    clump.add(100, 0.01, 0.05f, 3);
    check_estimate(std::move(clump), 1.3);
}

TEST_CASE("the number of pairs of two sizes of points is estimated, too", "[contacts]")
{
    Spheres two;
    two.add(50, 1, 0.5f, 4);
    two.add(4000, 1, 0.02f, 5);
    check_estimate(std::move(two), 1.3);
}

}  // namespace rapid
