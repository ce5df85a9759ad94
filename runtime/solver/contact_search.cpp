#include "runtime/solver/contact_search.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "runtime/parallel.h"

namespace rapid {
namespace {

// Cells farther than this from the middle, along an axis, are all the last one: neighbours stay neighbours, and a key
// fits 64 bits.
constexpr double farthest_cell = 1 << 20;

// Cells a sphere up to which all of them are kept, empty or not: finding one is then a look-up.
constexpr double dense_below = 8;

std::int64_t cell_of(double x, double width)
{
    return static_cast<std::int64_t>(std::clamp(std::floor(x / width), -farthest_cell, farthest_cell));
}

// A sum of radii in single precision, with room for the rounding of what it is compared with.
constexpr float rounding = 1 + 0x1p-20f;

// Calls f(m, cell coordinates) for the spheres of a chunk, in their order.
template <class Cells, class F>
void for_spheres(const Cells& cells, std::size_t first, std::size_t last, const F& f)
{
    // Back from the sphere's own place: within rounding of single precision it may seem to be in the next cell.
    std::size_t c = static_cast<std::size_t>(
        std::upper_bound(cells.begin.begin(), cells.begin.end(), static_cast<std::uint32_t>(first)) -
        cells.begin.begin() - 1);
    for (std::size_t m = first; m < last; ++m) {
        while (cells.begin[c + 1] <= m) ++c;
        const std::uint64_t key = cells.dense ? c : cells.key[c];
        const auto nx = static_cast<std::uint64_t>(cells.count[0]), ny = static_cast<std::uint64_t>(cells.count[1]);
        f(m, cells.least[0] + static_cast<std::int64_t>(key % nx),
          cells.least[1] + static_cast<std::int64_t>(key / nx % ny),
          cells.least[2] + static_cast<std::int64_t>(key / nx / ny));
    }
}

}  // namespace

RadiusGrids::RadiusGrids(Strided<float> radius, std::size_t size, double max_difference, int max_grids)
{
    if (size == 0) return;
    std::vector<float> sorted;  // distinct, from large to small
    if (radius.stride == 0) {
        sorted.push_back(radius[0]);
    } else {
        sorted.assign(radius.data, radius.data + size);
        tbb::parallel_sort(sorted.begin(), sorted.end(), std::greater<>());
        sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    }
    const bool some_without = !(sorted.back() > 0);
    while (!sorted.empty() && !(sorted.back() > 0)) sorted.pop_back();

    std::vector<float> least;  // of each grid
    const auto most = static_cast<std::size_t>(std::clamp<int>(max_grids, 1, none - 1));
    for (const float r : sorted) {
        if (grids.empty() || (grids.back().radius - r > max_difference && grids.size() < most)) {
            grids.push_back({r, 0});
            least.push_back(r);
        }
        least.back() = r;
    }
    if (grids.size() <= 1 && !some_without) {
        if (!grids.empty()) grids[0].points = size;
    } else {
        of.resize(size);
        for (std::size_t i = 0; i < size; ++i) {
            std::size_t g = 0;
            while (g < grids.size() && radius[i] < least[g]) ++g;
            if (!(radius[i] > 0)) g = grids.size();
            of[i] = g < grids.size() ? static_cast<std::uint8_t>(g) : none;
            if (g < grids.size()) ++grids[g].points;
        }
    }
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

ContactSearch::Cells::Run ContactSearch::Cells::run(std::int64_t i0, std::int64_t i1, std::int64_t j,
                                                    std::int64_t k) const
{
    if (j < least[1] || j >= least[1] + count[1] || k < least[2] || k >= least[2] + count[2]) return {0, 0};
    i0 = std::max(i0, least[0]);
    i1 = std::min(i1, least[0] + count[0] - 1);
    if (i0 > i1) return {0, 0};
    const std::uint64_t a = key_of(i0, j, k), b = a + static_cast<std::uint64_t>(i1 - i0);
    if (dense) return {begin[a], begin[b + 1]};
    const auto first = std::lower_bound(key.begin(), key.end(), a);
    auto last = first;
    while (last != key.end() && *last <= b) ++last;
    return {begin[static_cast<std::size_t>(first - key.begin())], begin[static_cast<std::size_t>(last - key.begin())]};
}

void ContactSearch::fill(Cells& cells, std::span<const Vec3d> P, Strided<float> reach, const RadiusGrids& grids,
                         std::size_t g)
{
    members_.clear();
    if (grids.of.empty()) {
        members_.resize(P.size());
        std::iota(members_.begin(), members_.end(), 0u);
    } else {
        for (std::size_t i = 0; i < P.size(); ++i)
            if (grids.of[i] == g) members_.push_back(static_cast<std::uint32_t>(i));
    }
    const std::size_t n = members_.size();
    const double per_width = 1 / cells.width;

    Eigen::Array3d low = Eigen::Array3d::Constant(farthest_cell), high = -low;
    for (const std::uint32_t i : members_) {
        const Eigen::Array3d at = (P[i] - middle_).array();
        low = low.min(at), high = high.max(at);
    }
    double all = 1;
    for (int k = 0; k < 3; ++k) {
        cells.least[k] = cell_of(low[k], cells.width);
        cells.count[k] = cell_of(high[k], cells.width) - cells.least[k] + 1;
        all *= static_cast<double>(cells.count[k]);
    }
    cells.dense = all <= dense_below * static_cast<double>(n) + 4096;

    keys_.resize(n);
    for_each_chunk(n, [&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m) {
            std::int64_t c[3];
            for (int k = 0; k < 3; ++k) {
                const double x = (P[members_[m]][k] - middle_[k]) * per_width;
                c[k] = static_cast<std::int64_t>(std::clamp(std::floor(x), -farthest_cell, farthest_cell));
                c[k] = std::clamp(c[k], cells.least[k], cells.least[k] + cells.count[k] - 1);
            }
            keys_[m] = cells.key_of(c[0], c[1], c[2]);
        }
    });

    cells.key.clear();
    order_.resize(n);
    if (cells.dense) {
        cells.begin.assign(static_cast<std::size_t>(all) + 2, 0);
        for (std::size_t m = 0; m < n; ++m) ++cells.begin[keys_[m] + 2];
        std::partial_sum(cells.begin.begin(), cells.begin.end(), cells.begin.begin());
        for (std::size_t m = 0; m < n; ++m) order_[cells.begin[keys_[m] + 1]++] = static_cast<std::uint32_t>(m);
        cells.begin.pop_back();
    } else {
        std::iota(order_.begin(), order_.end(), 0u);
        tbb::parallel_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::pair(keys_[a], a) < std::pair(keys_[b], b);
        });
        cells.begin.clear();
        for (std::size_t m = 0; m < n; ++m) {
            if (m > 0 && keys_[order_[m]] == cells.key.back()) continue;
            cells.key.push_back(keys_[order_[m]]);
            cells.begin.push_back(static_cast<std::uint32_t>(m));
        }
        cells.begin.push_back(static_cast<std::uint32_t>(n));
    }

    for (std::vector<float>* column : {&cells.x, &cells.y, &cells.z, &cells.r}) column->resize(n);
    cells.place.resize(n);
    for_each_chunk(n, [&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m) {
            const std::uint32_t i = members_[order_[m]];
            cells.place[m] = i;
            const Vec3d at = P[i] - middle_;
            cells.x[m] = static_cast<float>(at.x());
            cells.y[m] = static_cast<float>(at.y());
            cells.z[m] = static_cast<float>(at.z());
            cells.r[m] = reach[i];
        }
    });
}

// Half of the neighbourhood: each pair from the sphere that comes first in the cells.
void ContactSearch::within(const Cells& cells, std::span<const Vec3d> P, Strided<float> reach)
{
    const std::size_t n = cells.place.size();
    std::vector<Found>& found = room_for(n);
    const float blur = static_cast<float>(2 * blur_);
    for_each_chunk(n, [&](std::size_t first, std::size_t last) {
        Found& pairs = found[first / chunk_size];
        pairs.clear();
        std::vector<std::uint32_t> near(64);
        std::int64_t ci = 0, cj = 0, ck = 0;
        Cells::Run runs[5] = {};
        bool fresh = true;
        for_spheres(cells, first, last, [&](std::size_t m, std::int64_t i, std::int64_t j, std::int64_t k) {
            if (fresh || i != ci || j != cj || k != ck) {
                fresh = false;
                ci = i, cj = j, ck = k;
                runs[0] = cells.run(i, i + 1, j, k);
                runs[1] = cells.run(i - 1, i + 1, j + 1, k);
                for (int d = -1; d <= 1; ++d) runs[d + 3] = cells.run(i - 1, i + 1, j + d, k + 1);
            }
            runs[0].begin = static_cast<std::uint32_t>(m + 1);
            const float x = cells.x[m], y = cells.y[m], z = cells.z[m], r = rounding * cells.r[m] + blur;
            std::size_t count = 0;
            for (const Cells::Run& run : runs) {
                if (near.size() < count + (run.end - std::min(run.begin, run.end)) + 1)
                    near.resize(2 * (count + run.end - run.begin) + 1);
                for (std::uint32_t o = run.begin; o < run.end; ++o) {
                    const float dx = cells.x[o] - x, dy = cells.y[o] - y, dz = cells.z[o] - z,
                                d = rounding * cells.r[o] + r;
                    near[count] = o;
                    count += dx * dx + dy * dy + dz * dz < d * d;
                }
            }
            // Only what single precision can't decide is asked of the points themselves, which lie anywhere.
            const std::uint32_t a = cells.place[m];
            const float sure = (2 - rounding) * cells.r[m] - blur;
            for (std::size_t c = 0; c < count; ++c) {
                const std::uint32_t o = near[c], b = cells.place[o];
                const float dx = cells.x[o] - x, dy = cells.y[o] - y, dz = cells.z[o] - z;
                const float within_sum = (2 - rounding) * cells.r[o] + sure;
                if (!(within_sum > 0 && dx * dx + dy * dy + dz * dz < within_sum * within_sum)) {
                    const double d = double(reach[a]) + double(reach[b]);
                    if (!((P[a] - P[b]).squaredNorm() < d * d)) continue;
                }
                pairs.emplace_back(std::min(a, b), std::max(a, b));
            }
        });
    });
}

// All of the neighbourhood of each sphere of the finer grid in the coarser.
void ContactSearch::between(const Cells& fine, const Cells& coarse, std::span<const Vec3d> P, Strided<float> reach)
{
    const std::size_t n = fine.place.size();
    std::vector<Found>& found = room_for(n);
    const float blur = static_cast<float>(2 * blur_);
    for_each_chunk(n, [&](std::size_t first, std::size_t last) {
        Found& pairs = found[first / chunk_size];
        pairs.clear();
        for (std::size_t m = first; m < last; ++m) {
            const std::uint32_t a = fine.place[m];
            std::int64_t c[3];
            for (int k = 0; k < 3; ++k) c[k] = cell_of(P[a][k] - middle_[k], coarse.width);
            const float x = fine.x[m], y = fine.y[m], z = fine.z[m], r = rounding * fine.r[m] + blur;
            for (std::int64_t k = c[2] - 1; k <= c[2] + 1; ++k)
                for (std::int64_t j = c[1] - 1; j <= c[1] + 1; ++j) {
                    const Cells::Run run = coarse.run(c[0] - 1, c[0] + 1, j, k);
                    for (std::uint32_t o = run.begin; o < run.end; ++o) {
                        const float dx = coarse.x[o] - x, dy = coarse.y[o] - y, dz = coarse.z[o] - z;
                        const float sum = rounding * coarse.r[o] + r;
                        if (dx * dx + dy * dy + dz * dz >= sum * sum) continue;
                        const std::uint32_t b = coarse.place[o];
                        const double d = double(reach[a]) + double(reach[b]);
                        if ((P[a] - P[b]).squaredNorm() < d * d) pairs.emplace_back(std::min(a, b), std::max(a, b));
                    }
                }
        }
    });
}

std::vector<ContactSearch::Found>& ContactSearch::room_for(std::size_t spheres)
{
    if (used_ == found_.size()) found_.emplace_back();
    std::vector<Found>& found = found_[used_++];
    found.resize((spheres + chunk_size - 1) / chunk_size);
    return found;
}

void ContactSearch::find(std::span<const Vec3d> P, Strided<float> reach, const RadiusGrids& grids, Pairs& pairs)
{
    const std::size_t n = P.size();
    middle_.setZero();
    for (const Vec3d& x : P) middle_ += x;
    if (n > 0) middle_ /= static_cast<double>(n);
    double extent = 0;
    for (const Vec3d& x : P) extent = std::max(extent, (x - middle_).cwiseAbs().maxCoeff());
    blur_ = 0x1p-22 * extent;

    // A cell is as wide as two spheres that reach farthest, of its grid or a finer one.
    cells_.resize(grids.grids.size());
    for (Cells& cells : cells_) cells.width = 0;
    for (std::size_t i = 0; i < (reach.stride || !grids.of.empty() ? n : std::min<std::size_t>(n, 1)); ++i) {
        const std::size_t g = grids.of.empty() ? 0 : grids.of[i];
        if (g < cells_.size()) cells_[g].width = std::max(cells_[g].width, 2.0 * reach[i]);
    }
    for (std::size_t g = cells_.size(); g-- > 1;) cells_[g - 1].width = std::max(cells_[g - 1].width, cells_[g].width);
    used_ = 0;
    for (std::size_t g = 0; g < cells_.size(); ++g) {
        fill(cells_[g], P, reach, grids, g);
        within(cells_[g], P, reach);
        for (std::size_t c = 0; c < g; ++c) between(cells_[g], cells_[c], P, reach);
    }

    pairs.begin.assign(n + 2, 0);
    for (const auto& part : std::span(found_).first(used_))
        for (const Found& found : part)
            for (const auto& [a, b] : found) ++pairs.begin[a + 2];
    std::partial_sum(pairs.begin.begin(), pairs.begin.end(), pairs.begin.begin());
    pairs.other.resize(pairs.begin.back());
    for (const auto& part : std::span(found_).first(used_))
        for (const Found& found : part)
            for (const auto& [a, b] : found) pairs.other[pairs.begin[a + 1]++] = b;
    pairs.begin.pop_back();
    for_each_chunk(n, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            std::sort(pairs.other.begin() + pairs.begin[i], pairs.other.begin() + pairs.begin[i + 1]);
    });
}

}  // namespace rapid
