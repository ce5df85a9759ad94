#include "runtime/operators/goal/free_places.h"

#include <limits>
#include <random>

#include "tests/test.h"

using namespace rapid;

namespace {

std::vector<Vec3d> random_places(std::size_t n, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> coordinate(-9, 9);  // creates many ties
    std::vector<Vec3d> places;
    for (std::size_t k = 0; k < n; ++k) places.emplace_back(coordinate(random), coordinate(random), coordinate(random));
    return places;
}

}  // namespace

TEST_CASE("places are taken as a search of all would: the nearest of those with the fewest takers", "[goal]")
{
    const std::size_t n = GENERATE(1, 2, 7, 100, 513);
    CAPTURE(n);
    const std::vector<Vec3d> places = random_places(n, 1), seekers = random_places(3 * n + 5, 2);
    std::vector<std::uint32_t> takers(n);
    for (std::size_t k = 0; k < n; ++k) takers[k] = k % 3;
    FreePlaces free(places, takers);
    for (const Vec3d& P : seekers) {
        std::size_t best = n;
        for (std::size_t k = 0; k < n; ++k) {
            if (takers[k] != *std::min_element(takers.begin(), takers.end())) continue;
            if (best == n || (places[k] - P).squaredNorm() < (places[best] - P).squaredNorm()) best = k;
        }
        ++takers[best];
        REQUIRE(free.take(P) == best);
    }
}

TEST_CASE("who is nowhere takes some place all the same", "[goal]")
{
    FreePlaces free(random_places(5, 3), std::vector<std::uint32_t>(5));
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    std::vector<int> taken(5);
    for (const Vec3d& P :
         {Vec3d(nan, 0, 0), Vec3d(0, infinity, 0), Vec3d(1e38, 1e38, 1e38), Vec3d(0, -infinity, nan), Vec3d(0, 0, 0)})
        ++taken[free.take(P)];
    CHECK(taken == std::vector<int>(5, 1));
}
