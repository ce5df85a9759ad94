#include "runtime/solver/constraints/contact_search.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
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

// Spheres whose neighbours are looked for together: a fraction of a millisecond's work, so that a few thousand are
// enough for several threads.
constexpr std::size_t spheres_a_task = 2048;

// How many spheres, or points with their pairs, are sorted together: in the second-level cache, and on all threads.
std::size_t bucket_size(std::size_t n) { return std::clamp<std::size_t>(n / 8, spheres_a_task, 8192); }

// Spheres that are tested at a time.
constexpr std::uint32_t lanes = 8;

// Where the items of each bucket go that come from each source: counts, bucket by bucket, become places.
void to_places(std::vector<std::uint32_t>& counts)
{
    std::exclusive_scan(counts.begin(), counts.end(), counts.begin(), 0u);
}

// Few to a list, mostly: std::sort would take longer to start.
void sort_few(std::uint32_t* first, std::uint32_t* last)
{
    if (last - first > 32) return std::sort(first, last);
    for (std::uint32_t* next = first + 1; next < last; ++next) {
        const std::uint32_t value = *next;
        std::uint32_t* hole = next;
        for (; hole > first && hole[-1] > value; --hole) *hole = hole[-1];
        *hole = value;
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

inline ContactSearch::Cells::Run ContactSearch::Cells::run(std::uint64_t a, std::uint64_t b) const
{
    if (dense) return {begin[a], begin[b + 1]};
    const auto first = std::lower_bound(key.begin(), key.end(), a);
    auto last = first;
    while (last != key.end() && *last <= b) ++last;
    return {begin[static_cast<std::size_t>(first - key.begin())], begin[static_cast<std::size_t>(last - key.begin())]};
}

ContactSearch::Cells::Run ContactSearch::Cells::row(std::int64_t i0, std::int64_t i1, std::int64_t j,
                                                    std::int64_t k) const
{
    if (j < least[1] || j >= least[1] + count[1] || k < least[2] || k >= least[2] + count[2]) return {0, 0};
    i0 = std::max(i0, least[0]);
    i1 = std::min(i1, least[0] + count[0] - 1);
    if (i0 > i1) return {0, 0};
    const std::uint64_t first = key_of(i0, j, k);
    return run(first, first + static_cast<std::uint64_t>(i1 - i0));
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
    const std::size_t n = cells.size = members_.size();
    const double per_width = 1 / cells.width;

    Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const std::uint32_t i : members_) {
        const Eigen::Array3d at = (P[i] - middle_).array();
        low = low.min(at), high = high.max(at);
    }
    double all = 1;
    for (int k = 0; k < 3; ++k) {
        cells.least[k] = cell_of(low[k], cells.width) - 1;
        cells.count[k] = cell_of(high[k], cells.width) + 2 - cells.least[k];
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
                c[k] = std::clamp(c[k], cells.least[k] + 1, cells.least[k] + cells.count[k] - 2);
            }
            keys_[m] = cells.key_of(c[0], c[1], c[2]);
        }
    });
    for (std::vector<float>* column : {&cells.x, &cells.y, &cells.z, &cells.r}) column->resize(n + lanes);
    cells.place.resize(n);
    const auto sphere = [&](std::size_t m) {
        const std::uint32_t i = members_[m];
        const Vec3f at = (P[i] - middle_).cast<float>();
        return Sphere{at.x(), at.y(), at.z(), reach[i], i, 0};
    };
    if (cells.dense)
        sort_dense(cells, static_cast<std::size_t>(all), sphere);
    else
        sort_sparse(cells, sphere);
}

// Into buckets of cells first, and then each of these into its cells: in the order of the set, within a cell.
template <class F>
void ContactSearch::sort_dense(Cells& cells, std::size_t all, const F& sphere)
{
    const std::size_t n = cells.size, each_size = bucket_size(n), buckets = n / each_size + 1;
    const std::size_t chunks = (n + each_size - 1) / each_size, cells_each = all / buckets + 1;
    starts_.assign(buckets * chunks + 1, 0);
    const auto each = [&](const auto& f) { for_each_chunk(n, f, each_size); };
    each([&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m) ++starts_[keys_[m] / cells_each * chunks + first / each_size];
    });
    to_places(starts_);
    ends_ = starts_;
    spheres_.resize(n);
    each([&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m) {
            Sphere& to = spheres_[ends_[keys_[m] / cells_each * chunks + first / each_size]++];
            to = sphere(m);
            to.cell = static_cast<std::uint32_t>(keys_[m]);
        }
    });
    cells.begin.resize(all + 1);
    cells.begin[0] = 0;
    const auto sort = [&](std::size_t bucket) {
        const std::span<const Sphere> here = std::span(spheres_).subspan(
            starts_[bucket * chunks], starts_[(bucket + 1) * chunks] - starts_[bucket * chunks]);
        std::uint32_t* end = cells.begin.data() + 1;  // of each cell, once its spheres are there
        const std::size_t first = bucket * cells_each, last = std::min(all, first + cells_each);
        if (first >= last) return;
        std::fill(end + first, end + last, 0);
        for (const Sphere& s : here) ++end[s.cell];
        std::exclusive_scan(end + first, end + last, end + first, starts_[bucket * chunks]);
        for (const Sphere& s : here) cells.put(end[s.cell]++, s);
    };
    for_each_chunk(
        buckets, [&](std::size_t bucket, std::size_t) { sort(bucket); }, 1);
}

template <class F>
void ContactSearch::sort_sparse(Cells& cells, const F& sphere)
{
    const std::size_t n = cells.size;
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), 0u);
    tbb::parallel_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(keys_[a], a) < std::pair(keys_[b], b);
    });
    cells.key.clear();
    cells.begin.clear();
    for (std::size_t m = 0; m < n; ++m) {
        if (m > 0 && keys_[order_[m]] == cells.key.back()) continue;
        cells.key.push_back(keys_[order_[m]]);
        cells.begin.push_back(static_cast<std::uint32_t>(m));
    }
    cells.begin.push_back(static_cast<std::uint32_t>(n));
    for_each_chunk(n, [&](std::size_t first, std::size_t last) {
        for (std::size_t m = first; m < last; ++m) cells.put(m, sphere(order_[m]));
    });
}

// Lane by lane in one instruction; left to loops, the compiler takes them apart.
typedef float Eight __attribute__((vector_size(4 * lanes)));
typedef std::int32_t Flags __attribute__((vector_size(4 * lanes)));
typedef std::int8_t Bytes __attribute__((vector_size(lanes)));

Eight load(const float* from)
{
    Eight eight;
    std::memcpy(&eight, from, sizeof eight);
    return eight;
}

// Calls f(sphere, whether that is sure) for the spheres of some runs that are near the sphere m. They are tested first
// and told then: a processor that guesses how many there are to a run is mostly wrong.
template <class Cells, class Runs, class F>
inline void for_near(const Cells& cells, std::size_t m, const Runs& runs, float blur, const F& f)
{
    const float x = cells.x[m], y = cells.y[m], z = cells.z[m];
    const float most = rounding * cells.r[m] + blur, least = (2 - rounding) * cells.r[m] - blur;
    // Of each group of eight a bit in every byte, which is the lane's.
    constexpr std::uint64_t first_bits = 0x0101010101010101;
    std::uint64_t near = 0, sure = 0;
    std::uint32_t start[8];
    std::uint32_t groups = 0;
    const auto tell = [&] {
        for (; near != 0; near &= near - 1) {
            const auto at = static_cast<std::uint32_t>(std::countr_zero(near));
            f(start[at % 8] + at / 8, (sure >> at & 1) != 0);
        }
        sure = 0;
        groups = 0;
    };
    for (const auto& run : runs) {
        std::uint32_t o = run.begin;
        do {
            const Eight dx = load(&cells.x[o]) - x, dy = load(&cells.y[o]) - y, dz = load(&cells.z[o]) - z;
            const Eight r = load(&cells.r[o]), d2 = dx * dx + dy * dy + dz * dz;
            const Eight reach = rounding * r + most, within = (2 - rounding) * r + least;
            const Flags flags = ((d2 < reach * reach) & 1) | ((d2 < within * within) & (within > 0) & 2);
            const auto bytes = std::bit_cast<std::uint64_t>(__builtin_convertvector(flags, Bytes));
            const std::uint32_t count = std::min<std::uint32_t>(lanes, run.end - o);
            const std::uint64_t there =
                first_bits & (count == lanes ? ~std::uint64_t{0} : (std::uint64_t{1} << 8 * count) - 1);
            near |= (bytes & there) << groups;
            sure |= (bytes >> 1 & there) << groups;
            start[groups++] = o;
            if (groups == 8) tell();
            o += lanes;
        } while (o < run.end);
    }
    tell();
}

// Half of the neighbourhood: each pair from the sphere that comes first in the cells.
void ContactSearch::within(const Cells& cells, std::span<const Vec3d> P, Strided<float> reach)
{
    const std::size_t n = cells.size;
    std::vector<Found>& found = room_for(n);
    const float blur = static_cast<float>(2 * blur_);
    const auto nx = static_cast<std::uint64_t>(cells.count[0]), layer = nx * static_cast<std::uint64_t>(cells.count[1]);
    const auto look = [&](std::size_t first, std::size_t last) {
        Found& pairs = found[first / spheres_a_task];
        pairs.clear();
        auto c = static_cast<std::size_t>(
            std::upper_bound(cells.begin.begin(), cells.begin.end(), static_cast<std::uint32_t>(first)) -
            cells.begin.begin() - 1);
        for (std::size_t m = first; m < last; ++c) {
            const std::size_t end = std::min<std::size_t>(last, cells.begin[c + 1]);
            if (m == end) continue;
            const std::uint64_t key = cells.dense ? c : cells.key[c];
            Cells::Run runs[5] = {cells.run(key, key + 1), cells.run(key + nx - 1, key + nx + 1)};
            for (int d = 0; d < 3; ++d) {
                const std::uint64_t above = key + layer + static_cast<std::uint64_t>(d) * nx - nx;
                runs[2 + d] = cells.run(above - 1, above + 1);
            }
            for (; m < end; ++m) {
                runs[0].begin = static_cast<std::uint32_t>(m + 1);
                const std::uint32_t a = cells.place[m];
                const auto emit = [&](std::uint32_t o, bool sure) {
                    const std::uint32_t b = cells.place[o];
                    // Only what single precision can't decide is asked of the points themselves, which lie anywhere.
                    if (!sure) {
                        const double d = double(reach[a]) + double(reach[b]);
                        if (!((P[a] - P[b]).squaredNorm() < d * d)) return;
                    }
                    pairs.emplace_back(std::min(a, b), std::max(a, b));
                };
                for_near(cells, m, runs, blur, emit);
            }
        }
    };
    for_each_chunk(n, look, spheres_a_task);
}

// All of the neighbourhood of each sphere of the finer grid in the coarser.
void ContactSearch::between(const Cells& fine, const Cells& coarse, std::span<const Vec3d> P, Strided<float> reach)
{
    const std::size_t n = fine.size;
    std::vector<Found>& found = room_for(n);
    const float blur = static_cast<float>(2 * blur_);
    const auto look = [&](std::size_t first, std::size_t last) {
        Found& pairs = found[first / spheres_a_task];
        pairs.clear();
        for (std::size_t m = first; m < last; ++m) {
            const std::uint32_t a = fine.place[m];
            std::int64_t c[3];
            for (int k = 0; k < 3; ++k) c[k] = cell_of(P[a][k] - middle_[k], coarse.width);
            const float x = fine.x[m], y = fine.y[m], z = fine.z[m], r = rounding * fine.r[m] + blur;
            for (std::int64_t k = c[2] - 1; k <= c[2] + 1; ++k)
                for (std::int64_t j = c[1] - 1; j <= c[1] + 1; ++j) {
                    const Cells::Run run = coarse.row(c[0] - 1, c[0] + 1, j, k);
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
    };
    for_each_chunk(n, look, spheres_a_task);
}

std::vector<ContactSearch::Found>& ContactSearch::room_for(std::size_t spheres)
{
    if (used_ == found_.size()) found_.emplace_back();
    std::vector<Found>& found = found_[used_++];
    found.resize((spheres + spheres_a_task - 1) / spheres_a_task);
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

    list(pairs, n);
}

// Into buckets of points first, and then each of these point by point.
void ContactSearch::list(Pairs& pairs, std::size_t points)
{
    std::vector<const Found*> sources;
    for (const auto& part : std::span(found_).first(used_))
        for (const Found& found : part) sources.push_back(&found);
    const std::size_t each_size = bucket_size(points), buckets = points / each_size + 1, chunks = sources.size();
    starts_.assign(buckets * chunks + 1, 0);
    const auto each = [&](const auto& f) {
        for_each_chunk(
            chunks, [&](std::size_t c, std::size_t) { f(c); }, 1);
    };
    each([&](std::size_t c) {
        for (const Pair& pair : *sources[c]) ++starts_[pair.first / each_size * chunks + c];
    });
    to_places(starts_);
    ends_ = starts_;
    pairs_.resize(starts_.back());
    each([&](std::size_t c) {
        for (const Pair& pair : *sources[c]) pairs_[ends_[pair.first / each_size * chunks + c]++] = pair;
    });
    pairs.begin.resize(points + 1);
    pairs.begin[0] = 0;
    pairs.other.resize(pairs_.size());
    for_each_chunk(
        points + 1,
        [&](std::size_t first, std::size_t last) {
            const std::size_t bucket = first / each_size;
            last = std::min(last, points);
            if (first == last) return;
            const std::uint32_t start = starts_[bucket * chunks];
            const std::span<const Pair> here = std::span(pairs_).subspan(start, starts_[(bucket + 1) * chunks] - start);
            std::uint32_t* end = pairs.begin.data() + 1;  // of each point's partners, once they are there
            std::fill(end + first, end + last, 0);
            for (const Pair& pair : here) ++end[pair.first];
            std::exclusive_scan(end + first, end + last, end + first, start);
            for (const Pair& pair : here) pairs.other[end[pair.first]++] = pair.second;
            std::uint32_t begin = start;
            for (std::size_t i = first; i < last; begin = end[i++])
                sort_few(pairs.other.data() + begin, pairs.other.data() + end[i]);
        },
        each_size);
}

}  // namespace rapid
