#include "runtime/points/cell_grid.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "runtime/base/parallel.h"

namespace rapid {
namespace {

constexpr double farthest_cell = 1 << 20;

// Cells per sphere up to which the grid stores all cells, empty or not. Finding a cell is then a table look-up.
constexpr double dense_below = 8;

// Returns the cell coordinate along an axis. It is clamped to the farthest cell: neighbours stay neighbours, and a key
// fits 64 bits.
std::int64_t cell_coordinate(double x, double width)
{
    return static_cast<std::int64_t>(std::clamp(std::floor(x / width), -farthest_cell, farthest_cell));
}

}  // namespace

std::size_t bucket_size(std::size_t n) { return std::clamp<std::size_t>(n / 8, 2048, 8192); }

CellGrid::Run CellGrid::find_run(std::uint64_t a, std::uint64_t b) const
{
    const auto first = std::lower_bound(key_.begin(), key_.end(), a);
    auto last = first;
    while (last != key_.end() && *last <= b) ++last;
    return {begin_[static_cast<std::size_t>(first - key_.begin())],
            begin_[static_cast<std::size_t>(last - key_.begin())]};
}

CellGrid::Cell CellGrid::cell_at(const Vec3d& X) const
{
    return {cell_coordinate(X.x(), width), cell_coordinate(X.y(), width), cell_coordinate(X.z(), width)};
}

CellGrid::Runs CellGrid::around(const Cell& cell) const
{
    Runs runs;
    std::int64_t first[3];
    std::array<std::uint64_t, 3> cells;
    for (std::size_t k = 0; k < 3; ++k) {
        first[k] = std::max(cell[k] - 1, least_[k]);
        const std::int64_t end = std::min(cell[k] + 2, least_[k] + count_[k]);
        if (first[k] >= end) return runs;
        cells[k] = static_cast<std::uint64_t>(end - first[k]);
    }
    add_rows(runs, key_of(first[0], first[1], first[2]), cells);
    return runs;
}

std::size_t CellGrid::cell_of_sphere(std::size_t sphere) const
{
    return static_cast<std::size_t>(std::upper_bound(begin_.begin(), begin_.end(), static_cast<std::uint32_t>(sphere)) -
                                    begin_.begin() - 1);
}

void CellSorter::fill(CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members)
{
    const std::size_t n = members.size();
    const std::size_t cells = bound(grid, spheres, members);
    find_keys(grid, spheres, members);
    for (PageArray<float>* column : {&grid.x, &grid.y, &grid.z, &grid.r}) column->resize(n + lanes);
    grid.index.resize(n);
    if (grid.dense_)
        sort_dense(grid, cells, spheres, members);
    else
        sort_sparse(grid, spheres, members);
}

// Finds the bounds of the cells that hold spheres. Returns the number of cells within them if the grid is dense,
// otherwise 0.
std::size_t CellSorter::bound(CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members) const
{
    Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const std::uint32_t i : members) {
        const Eigen::Array3d at = spheres.in_grid(spheres.P[i]).array();
        low = low.min(at), high = high.max(at);
    }
    double all = 1;
    for (int k = 0; k < 3; ++k) {
        grid.least_[k] = cell_coordinate(low[k], grid.width) - 1;
        grid.count_[k] = cell_coordinate(high[k], grid.width) + 2 - grid.least_[k];
        all *= static_cast<double>(grid.count_[k]);
    }
    grid.dense_ = all <= dense_below * static_cast<double>(members.size()) + 4096;
    return grid.dense_ ? static_cast<std::size_t>(all) : 0;
}

void CellSorter::find_keys(const CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members)
{
    const double per_width = 1 / grid.width;
    keys_.resize(members.size());
    for_each_chunk(members.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m) {
            const Vec3d at = per_width * spheres.in_grid(spheres.P[members[m]]);
            std::int64_t c[3];
            for (int k = 0; k < 3; ++k) {
                c[k] = static_cast<std::int64_t>(std::clamp(std::floor(at[k]), -farthest_cell, farthest_cell));
                c[k] = std::clamp(c[k], grid.least_[k] + 1, grid.least_[k] + grid.count_[k] - 2);
            }
            keys_[m] = grid.key_of(c[0], c[1], c[2]);
        }
    });
}

inline CellSorter::Sphere CellSorter::sphere(const SpheresView& spheres, std::uint32_t index, std::uint64_t cell)
{
    const Vec3f at = spheres.in_grid(spheres.P[index]).cast<float>();
    return {at.x(), at.y(), at.z(), spheres.reach[index], index, static_cast<std::uint32_t>(cell)};
}

inline void CellSorter::put(CellGrid& grid, std::size_t m, const Sphere& sphere)
{
    grid.x[m] = sphere.x, grid.y[m] = sphere.y, grid.z[m] = sphere.z, grid.r[m] = sphere.r;
    grid.index[m] = sphere.index;
}

// Sorts the spheres into buckets of cells, then each bucket into its cells. Spheres of one cell keep the order of the
// set.
void CellSorter::sort_dense(CellGrid& grid, std::size_t cells, const SpheresView& spheres,
                            std::span<const std::uint32_t> members)
{
    const std::size_t n = members.size(), each_size = bucket_size(n), buckets = n / each_size + 1;
    const std::size_t chunks = (n + each_size - 1) / each_size, cells_each = cells / buckets + 1;
    starts_.assign(buckets * chunks + 1, 0);
    const auto each = [&](const auto& f) { for_each_chunk(n, f, each_size); };
    each([&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m) ++starts_[keys_[m] / cells_each * chunks + first / each_size];
    });
    std::exclusive_scan(starts_.begin(), starts_.end(), starts_.begin(), 0u);
    ends_ = starts_;
    spheres_.resize(n);
    each([&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m)
            spheres_[ends_[keys_[m] / cells_each * chunks + first / each_size]++] =
                sphere(spheres, members[m], keys_[m]);
    });
    grid.begin_.resize(cells + 1);
    grid.begin_[0] = 0;
    const auto sort = [&](std::size_t bucket) {
        const std::span<const Sphere> here = std::span(spheres_).subspan(
            starts_[bucket * chunks], starts_[(bucket + 1) * chunks] - starts_[bucket * chunks]);
        std::uint32_t* end = grid.begin_.data() + 1;  // end of each cell, once its spheres are in place
        const std::size_t first = bucket * cells_each, last = std::min(cells, first + cells_each);
        if (first >= last) return;
        std::fill(end + first, end + last, 0);
        for (const Sphere& s : here) ++end[s.cell];
        std::exclusive_scan(end + first, end + last, end + first, starts_[bucket * chunks]);
        for (const Sphere& s : here) put(grid, end[s.cell]++, s);
    };
    for_each_chunk(
        buckets, [&](std::size_t bucket, std::size_t) { sort(bucket); }, 1);
}

void CellSorter::sort_sparse(CellGrid& grid, const SpheresView& spheres, std::span<const std::uint32_t> members)
{
    const std::size_t n = members.size();
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), 0u);
    tbb::parallel_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(keys_[a], a) < std::pair(keys_[b], b);
    });
    grid.key_.clear();
    grid.begin_.resize(n + 1);
    for (std::size_t m = 0; m < n; ++m) {
        if (m > 0 && keys_[order_[m]] == grid.key_.back()) continue;
        grid.begin_[grid.key_.size()] = static_cast<std::uint32_t>(m);
        grid.key_.push_back(keys_[order_[m]]);
    }
    grid.begin_[grid.key_.size()] = static_cast<std::uint32_t>(n);
    grid.begin_.resize(grid.key_.size() + 1);
    for_each_chunk(n, [&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m) put(grid, m, sphere(spheres, members[order_[m]], 0));
    });
}

}  // namespace rapid
