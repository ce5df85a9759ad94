#include "runtime/solver/constraints/pair_estimate.h"

#include <numeric>
#include <vector>

#include "runtime/base/parallel.h"

namespace rapid {
namespace {

constexpr std::size_t samples = 64;

// Returns the number of spheres in a grid that touch this one, including itself if it is in the grid.
double neighbours(const CellGrid& grid, const SpheresView& spheres, std::uint32_t sphere)
{
    const Vec3d at = spheres.in_grid(spheres.P[sphere]);
    std::size_t found = 0;
    for (const CellGrid::Run& run : grid.around(grid.cell_at(at)))
        for (std::uint32_t o = run.begin; o < run.end; ++o) {
            const double reach = double(grid.r[o]) + double(spheres.reach[sphere]);
            found += (Vec3d(grid.x[o], grid.y[o], grid.z[o]) - at).squaredNorm() < reach * reach;
        }
    return static_cast<double>(found);
}

// Returns Σ n_c² for each stretch of cells.
std::vector<double> squares(const CellGrid& grid)
{
    std::vector<double> sums((grid.cells() + chunk_size - 1) / chunk_size);
    for_each_chunk(grid.cells(), [&](std::size_t begin, std::size_t end) {
        std::uint64_t sum = 0;
        for (std::size_t c = begin; c < end; ++c) {
            const std::uint64_t n = grid.end(c) - grid.begin(c);
            sum += n * n;
        }
        sums[begin / chunk_size] = static_cast<double>(sum);
    });
    return sums;
}

double sum_of(const std::vector<double>& sums) { return std::accumulate(sums.begin(), sums.end(), 0.0); }

double estimate_within(const CellGrid& grid, const SpheresView& spheres)
{
    const std::vector<double> sums = squares(grid);
    const double all = sum_of(sums);
    double mean = 0, before = 0;  // before: Σ n_c² of the preceding stretches
    std::size_t stretch = 0;
    for (std::size_t s = 0; s < samples; ++s) {
        const double target = (static_cast<double>(s) + 0.5) / samples * all;
        while (before + sums[stretch] < target) before += sums[stretch++];
        std::size_t cell = stretch * chunk_size;
        for (double reached = before;; ++cell) {
            const double n = grid.end(cell) - grid.begin(cell);
            reached += n * n;
            if (reached >= target) break;
        }
        const std::size_t n = grid.end(cell) - grid.begin(cell);
        const std::size_t sphere = grid.begin(cell) + s * n / samples;
        mean += (neighbours(grid, spheres, grid.index[sphere]) - 1) / static_cast<double>(n) / samples;
    }
    return 0.5 * all * mean;
}

double estimate_between(const CellGrid& fine, const CellGrid& coarse, const SpheresView& spheres)
{
    double mean = 0;
    for (std::size_t s = 0; s < samples; ++s)
        mean += neighbours(coarse, spheres, fine.index[s * fine.size() / samples]) / samples;
    return static_cast<double>(fine.size()) * mean;
}

}  // namespace

double max_pairs(std::span<const CellGrid> grids)
{
    double pairs = 0, coarser = 0;
    for (const CellGrid& grid : grids) {
        const double size = static_cast<double>(grid.size());
        pairs += 13.5 * sum_of(squares(grid)) + size * coarser;
        coarser += size;
    }
    return pairs;
}

double estimate_pairs(std::span<const CellGrid> grids, const SpheresView& spheres)
{
    double pairs = 0;
    for (std::size_t g = 0; g < grids.size(); ++g) {
        pairs += estimate_within(grids[g], spheres);
        for (std::size_t c = 0; c < g; ++c) pairs += estimate_between(grids[g], grids[c], spheres);
    }
    return pairs;
}

}  // namespace rapid
