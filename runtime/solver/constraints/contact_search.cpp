#include "runtime/solver/constraints/contact_search.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/base/parallel.h"
#include "runtime/math/vec.h"
#include "runtime/points/neighbours.h"

namespace rapid {

RadiusGrids::RadiusGrids(Strided<float> radius, std::size_t size, std::optional<double> max_difference, int max_grids)
{
    if (size == 0) return;
    std::vector<float> sorted;  // distinct, descending
    if (radius.stride == 0) {
        sorted.push_back(radius[0]);
    } else {
        sorted.assign(radius.data, radius.data + size);
        tbb::parallel_sort(sorted.begin(), sorted.end(), std::greater<>());
        sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    }
    const bool some_without = !(sorted.back() > 0);
    while (!sorted.empty() && !(sorted.back() > 0)) sorted.pop_back();

    std::vector<float> least;  // lower bound of the radii in each grid
    cluster(sorted, max_difference, max_grids, least);
    if (grids.size() > 1 || some_without)
        assign(radius, size, least);
    else if (!grids.empty())
        grids[0].points = size;
    measure(radius, size);
}

void RadiusGrids::cluster(std::span<const float> descending, std::optional<double> max_difference, int max_grids,
                          std::vector<float>& least)
{
    const auto most = static_cast<std::size_t>(std::clamp<int>(max_grids, 1, none - 1));
    const auto is_too_small = [&](double r, const Grid& grid) {
        return grid.radius - r > max_difference.value_or(0.5 * grid.radius);
    };
    for (const float r : descending) {
        if (grids.empty() || (is_too_small(r, grids.back()) && grids.size() < most)) {
            grids.push_back({r, 0});
            least.push_back(r);
        }
        least.back() = r;
    }
}

void RadiusGrids::assign(Strided<float> radius, std::size_t size, std::span<const float> least)
{
    of.resize(size);
    for (std::size_t i = 0; i < size; ++i) {
        std::size_t g = 0;
        while (g < grids.size() && radius[i] < least[g]) ++g;
        if (!(radius[i] > 0)) g = grids.size();
        of[i] = g < grids.size() ? static_cast<std::uint8_t>(g) : none;
        if (g < grids.size()) ++grids[g].points;
    }
}

void RadiusGrids::measure(Strided<float> radius, std::size_t size)
{
    double cells = 0, spheres = 0, cut = 0;
    for (std::size_t i = 0; i < size; ++i) {
        if (!of.empty() && of[i] == none) continue;
        const double s = 2 * grids[of.empty() ? 0 : of[i]].radius, d = 2.0 * radius[i];
        cells += s * s * s;
        cut += d * d * d;
        spheres += EIGEN_PI / 6 * d * d * d;
    }
    error = cells - spheres;
    excess = cut > 0 ? (cells - cut) / cut : 0;
}

namespace {

// Spheres whose neighbours are searched in one task: a fraction of a millisecond of work, so a few thousand already
// use several threads.
constexpr std::size_t spheres_per_task = 2048;

// Pairs are numbered with 32 bits.
constexpr double max_numbers = std::numeric_limits<std::uint32_t>::max();

// Decides pairs that single precision cannot decide.
bool spheres_touch(const SpheresView& spheres, std::uint32_t a, std::uint32_t b)
{
    const double d = double(spheres.reach[a]) + double(spheres.reach[b]);
    return (spheres.P[a] - spheres.P[b]).squaredNorm() < d * d;
}

}  // namespace

void ContactSearch::find(std::span<const Vec3d> P, Strided<float> reach, const RadiusGrids& grids, Pairs& pairs,
                         const PairUse& use)
{
    measure(P, reach);
    set_widths(grids);
    for (std::size_t g = 0; g < grids_.size(); ++g) {
        list_members(grids, g);
        sorter_.fill(grids_[g], spheres_, members_);
    }
    require_room(use);
    used_ = 0;
    for (std::size_t g = 0; g < grids_.size(); ++g) {
        find_within(grids_[g]);
        for (std::size_t c = 0; c < g; ++c) find_between(grids_[g], grids_[c]);
    }
    sort(pairs, P.size());
}

void ContactSearch::require_room(const PairUse& use) const
{
    const auto fit = [&](double pairs) { return pairs <= max_numbers && fits_in_memory(pairs * use.bytes_per_pair); };
    const double points = static_cast<double>(spheres_.P.size());
    if (fit(0.5 * points * points) || fit(max_pairs(grids_))) return;
    const double found = estimate_pairs(grids_, spheres_);
    if (fit(found)) return;
    const std::string what = fmt::format("{}: about {:.2g} pairs of {} points", use.what, found, spheres_.P.size());
    if (found > max_numbers)
        throw Error(fmt::format("{}; at most {:.2g} are possible; {}", what, max_numbers, use.remedy));
    throw memory_exceeded(what, found * use.bytes_per_pair, use.remedy);
}

void ContactSearch::measure(std::span<const Vec3d> P, Strided<float> reach)
{
    Vec3d middle = Vec3d::Zero();
    for (const Vec3d& x : P) middle += x;
    if (!P.empty()) middle /= static_cast<double>(P.size());
    double extent = 0;
    for (const Vec3d& x : P) extent = std::max(extent, (x - middle).cwiseAbs().maxCoeff());
    spheres_ = {P, reach, middle};
    blur_ = near_blur(extent);
}

// Makes a cell as wide as two spheres of the largest reach, in its grid or a finer one.
void ContactSearch::set_widths(const RadiusGrids& grids)
{
    const std::size_t n = spheres_.P.size();
    const bool all_alike = !spheres_.reach.stride && grids.of.empty();
    grids_.resize(grids.grids.size());
    for (CellGrid& grid : grids_) grid.width = 0;
    for (std::size_t i = 0; i < (all_alike ? std::min<std::size_t>(n, 1) : n); ++i) {
        const std::size_t g = grids.of.empty() ? 0 : grids.of[i];
        if (g < grids_.size()) grids_[g].width = std::max(grids_[g].width, 2.0 * spheres_.reach[i]);
    }
    for (std::size_t g = grids_.size(); g-- > 1;) grids_[g - 1].width = std::max(grids_[g - 1].width, grids_[g].width);
}

void ContactSearch::list_members(const RadiusGrids& grids, std::size_t grid)
{
    const std::size_t n = spheres_.P.size();
    members_.clear();
    if (grids.of.empty()) {
        members_.resize(n);
        std::iota(members_.begin(), members_.end(), 0u);
    } else {
        for (std::size_t i = 0; i < n; ++i)
            if (grids.of[i] == grid) members_.push_back(static_cast<std::uint32_t>(i));
    }
}

std::vector<ContactSearch::Found>& ContactSearch::room_for(std::size_t spheres)
{
    if (used_ == found_.size()) found_.emplace_back();
    std::vector<Found>& found = found_[used_++];
    found.resize((spheres + spheres_per_task - 1) / spheres_per_task);
    return found;
}

// Searches half of the neighbourhood: each pair is found from the sphere that comes first in the cells.
void ContactSearch::find_within(const CellGrid& grid)
{
    std::vector<Found>& found = room_for(grid.size());
    const auto look = [&](std::size_t first, std::size_t last) {
        Found& pairs = found[first / spheres_per_task];
        pairs.clear();
        NearSpheres spheres;
        grid.for_each_stretch(first, last, [&](std::size_t m, std::size_t end, std::size_t from, std::size_t to) {
            spheres.gather(grid, grid.after(grid.key(from), grid.key(to)));
            for (; m < end; ++m) {
                const std::uint32_t a = grid.index[m], skipped = static_cast<std::uint32_t>(m + 1) - grid.begin(from);
                spheres.for_each(grid, m, blur_, skipped, [&](std::uint32_t o, bool certain) {
                    const std::uint32_t b = grid.index[o];
                    if (!certain && !spheres_touch(spheres_, a, b)) return;
                    pairs.emplace_back(std::min(a, b), std::max(a, b));
                });
            }
        });
    };
    for_each_chunk(grid.size(), look, spheres_per_task);
}

// Searches the whole neighbourhood, in the coarser grid, of each sphere of the finer grid. Consecutive spheres often
// share a cell.
void ContactSearch::find_between(const CellGrid& fine, const CellGrid& coarse)
{
    std::vector<Found>& found = room_for(fine.size());
    const auto look = [&](std::size_t first, std::size_t last) {
        Found& pairs = found[first / spheres_per_task];
        pairs.clear();
        CellGrid::Cell cell{}, last_cell{};
        NearSpheres spheres;
        for (std::size_t m = first; m < last; ++m) {
            const std::uint32_t a = fine.index[m];
            cell = coarse.cell_at(spheres_.in_grid(spheres_.P[a]));
            if (m == first || cell != last_cell) spheres.gather(coarse, coarse.around(cell));
            last_cell = cell;
            spheres.for_each(fine, m, blur_, 0, [&](std::uint32_t o, bool certain) {
                const std::uint32_t b = coarse.index[o];
                if (certain || spheres_touch(spheres_, a, b)) pairs.emplace_back(std::min(a, b), std::max(a, b));
            });
        }
    };
    for_each_chunk(fine.size(), look, spheres_per_task);
}

// Sorts into buckets of points first, then sorts each bucket by point.
void ContactSearch::sort(Pairs& pairs, std::size_t points)
{
    std::vector<const Found*> sources;
    for (const auto& part : std::span(found_).first(used_))
        for (const Found& found : part) sources.push_back(&found);
    std::size_t all = 0;
    for (const Found* found : sources) all += found->size();
    if (static_cast<double>(all) > max_numbers)
        throw Error(fmt::format("{} pairs of points touch; at most {:.2g} are possible; give a smaller radius", all,
                                max_numbers));
    const std::size_t each_size = bucket_size(points), buckets = points / each_size + 1, chunks = sources.size();
    starts_.assign(buckets * chunks + 1, 0);
    const auto each = [&](const auto& f) {
        for_each_chunk(
            chunks, [&](std::size_t c, std::size_t) { f(c); }, 1);
    };
    each([&](std::size_t c) {
        for (const auto& pair : *sources[c]) ++starts_[pair.first / each_size * chunks + c];
    });
    std::exclusive_scan(starts_.begin(), starts_.end(), starts_.begin(), 0u);
    ends_ = starts_;
    pairs_.resize(starts_.back());
    each([&](std::size_t c) {
        for (const auto& pair : *sources[c]) pairs_[ends_[pair.first / each_size * chunks + c]++] = pair;
    });
    pairs.begin.resize(points + 1);
    pairs.begin[0] = 0;
    pairs.other.resize(pairs_.size());
    const auto sort_bucket = [&](std::size_t first, std::size_t last) {
        const std::size_t bucket = first / each_size;
        last = std::min(last, points);
        if (first == last) return;
        const std::uint32_t start = starts_[bucket * chunks];
        const std::span<const Found::value_type> here =
            std::span(pairs_).subspan(start, starts_[(bucket + 1) * chunks] - start);
        std::uint32_t* end = pairs.begin.data() + 1;  // end of each point's partners once these are inserted
        std::fill(end + first, end + last, 0);
        for (const auto& pair : here) ++end[pair.first];
        std::exclusive_scan(end + first, end + last, end + first, start);
        PageArray<std::uint32_t> others(here.size() + max_sorted_by_rank);
        for (const auto& pair : here) others[end[pair.first]++ - start] = pair.second;
        std::uint32_t begin = start;
        for (std::size_t i = first; i < last; begin = end[i++])
            sort_few(others.data() + (begin - start), end[i] - begin, pairs.other.data() + begin);
    };
    for_each_chunk(points + 1, sort_bucket, each_size);
}

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
