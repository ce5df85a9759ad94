// Compares Neighbours with a search over all pairs.
#include <tbb/global_control.h>

#include <algorithm>
#include <random>
#include <vector>

#include "runtime/points/neighbours.h"
#include "tests/test.h"

namespace rapid {
namespace {

std::vector<std::vector<std::uint32_t>> by_all_pairs(const std::vector<Vec3f>& P, double radius)
{
    std::vector<std::vector<std::uint32_t>> near(P.size());
    for (std::uint32_t i = 0; i < P.size(); ++i)
        for (std::uint32_t j = 0; j < P.size(); ++j)
            if ((P[i].cast<double>() - P[j].cast<double>()).squaredNorm() <= radius * radius) near[i].push_back(j);
    return near;
}

}  // namespace

TEST_CASE("neighbours are those among all pairs, for points and for any position, on any number of threads",
          "[neighbours][threads]")
{
    // Evenly distributed; far from the origin; in clumps so distant that most cells are empty; on a lattice, exactly at
    // the radius; and with coordinates whose squares underflow in single precision.
    const int shape = GENERATE(0, 1, 2, 3, 4);
    CAPTURE(shape);
    std::mt19937 random(5);
    std::uniform_real_distribution<float> in(-1, 1);
    std::vector<Vec3f> P;
    double radius = 0.2;
    for (int i = 0; i < 5000; ++i) {  // more than one chunk
        Vec3f at(in(random), in(random), in(random));
        if (shape == 1) at += Vec3f(1e4f, -1e4f, 3e3f);
        if (shape == 2) at = 0.1f * at + Vec3f(static_cast<float>(i % 7) * 1e5f, 0, 0);
        if (shape == 3)
            at = 0.25f * Vec3f(static_cast<float>(i % 10), static_cast<float>(i / 10 % 10),
                               static_cast<float>(i / 100 % 10));  // each position five times
        if (shape == 4) at *= 1e-30f;
        P.push_back(at);
    }
    if (shape == 3) radius = 0.25;
    if (shape == 4) radius = 2e-31;
    const auto expected = by_all_pairs(P, radius);
    std::size_t all = 0;
    for (const auto& near : expected) all += near.size();
    CHECK(all > 2 * P.size());

    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, GENERATE(1, 2));
    const Neighbours neighbours(P, radius);
    std::vector<std::vector<std::uint32_t>> found(P.size());
    neighbours.for_each([&](std::uint32_t i, std::vector<std::uint32_t>& near) { found[i] = near; });
    CHECK(found == expected);
    for (std::uint32_t i = 0; i < P.size(); ++i) neighbours.find(P[i].cast<double>(), found[i]);
    CHECK(found == expected);
}

TEST_CASE("a position far from all points has no neighbours, and an empty set has none", "[neighbours]")
{
    std::vector<std::uint32_t> near = {1};
    Neighbours({{Vec3f(0, 0, 0), Vec3f(1, 0, 0)}}, 0.5).find(Vec3d(1e9, 0, -1e12), near);
    CHECK(near.empty());
    const Neighbours none({}, 1);
    none.find(Vec3d(0, 0, 0), near);
    CHECK(near.empty());
    none.for_each([](std::uint32_t, std::vector<std::uint32_t>&) { FAIL(); });
}

TEST_CASE("a radius below what cells can tell apart is refused", "[neighbours]")
{
    const std::vector<Vec3f> P = {{100, 0, 0}};
    CHECK_THROWS_WITH(Neighbours(P, 0), Catch::Contains("the radius must be above 0, and above"));
    CHECK_THROWS_WITH(Neighbours(P, 1e-8), Catch::Contains("the radius must be above 0, and above 9.3"));
}

// Short lists of numbers, sorted by rank.
TEST_CASE("lists of any length are sorted, and the memory after them is untouched", "[sort]")
{
    std::mt19937 random(3);
    for (std::uint32_t count = 0; count <= 2 * max_sorted_by_rank; ++count) {
        CAPTURE(count);
        std::vector<std::uint32_t> from(count + max_sorted_by_rank, 0), to(count + 1, 7), expected;
        for (std::uint32_t k = 0; k < count; ++k) expected.push_back(k * 0x9e3779b9u);  // distinct, 0 to 2^32
        std::shuffle(expected.begin(), expected.end(), random);
        std::copy(expected.begin(), expected.end(), from.begin());
        std::sort(expected.begin(), expected.end());
        sort_few(from.data(), count, to.data());
        CHECK(to.back() == 7);
        to.pop_back();
        CHECK(to == expected);
    }
}

}  // namespace rapid
