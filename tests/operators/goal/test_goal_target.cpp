#include "runtime/operators/goal/goal_target.h"

#include <limits>
#include <random>

#include "tests/test.h"

using namespace rapid;

namespace {

std::vector<Vec3d> random_positions(std::size_t n, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> coordinate(-9, 9);  // creates many ties
    std::vector<Vec3d> positions;
    for (std::size_t k = 0; k < n; ++k)
        positions.emplace_back(coordinate(random), coordinate(random), coordinate(random));
    return positions;
}

}  // namespace

TEST_CASE("positions are chosen as by a full search: the nearest of those with the fewest points", "[goal]")
{
    const std::size_t n = GENERATE(1, 2, 7, 100, 513);
    CAPTURE(n);
    const std::vector<Vec3d> positions = random_positions(n, 1), seekers = random_positions(3 * n + 5, 2);
    std::vector<std::uint32_t> occupancy(n);
    for (std::size_t k = 0; k < n; ++k) occupancy[k] = k % 3;
    FreePositions free(positions, occupancy);
    for (const Vec3d& P : seekers) {
        std::size_t best = n;
        for (std::size_t k = 0; k < n; ++k) {
            if (occupancy[k] != *std::min_element(occupancy.begin(), occupancy.end())) continue;
            if (best == n || (positions[k] - P).squaredNorm() < (positions[best] - P).squaredNorm()) best = k;
        }
        ++occupancy[best];
        REQUIRE(free.take(P) == best);
    }
}

TEST_CASE("a point without a finite position still gets a target", "[goal]")
{
    FreePositions free(random_positions(5, 3), std::vector<std::uint32_t>(5));
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    std::vector<int> taken(5);
    for (const Vec3d& P :
         {Vec3d(nan, 0, 0), Vec3d(0, infinity, 0), Vec3d(1e38, 1e38, 1e38), Vec3d(0, -infinity, nan), Vec3d(0, 0, 0)})
        ++taken[free.take(P)];
    CHECK(taken == std::vector<int>(5, 1));
}
