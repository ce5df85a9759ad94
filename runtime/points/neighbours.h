// The points within a radius of a position or of each other, found with cells as wide as the radius (cell_grid.h).
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "runtime/base/parallel.h"
#include "runtime/math/simd.h"
#include "runtime/math/vec.h"
#include "runtime/points/cell_grid.h"

namespace rapid {

// Factor on a single-precision sum of radii that covers the rounding of the compared distance.
constexpr float near_rounding = 1 + 0x1p-20f;

// Returns the rounding error of a single-precision distance between two positions. extent: their largest distance from
// the middle.
inline float near_blur(double extent) { return static_cast<float>(2 * (0x1p-22 * extent)); }

// Spheres of several runs, copied contiguously. Most runs are shorter than a pack, and they are searched once for each
// sphere of a cell.
class NearSpheres {
public:
    void gather(const CellGrid& grid, const CellGrid::Runs& runs)
    {
        std::size_t all = 0;
        for (const CellGrid::Run& run : runs) all += run.end - run.begin;
        if (const std::size_t room = all + 2 * lanes; room > sphere_.size()) {
            for (std::vector<float>* column : {&x_, &y_, &z_, &r_}) column->resize(room);
            sphere_.resize(room);
        }
        size_ = 0;
        for (const CellGrid::Run& run : runs) {
            for (std::uint32_t o = run.begin, to = size_; o < run.end; o += lanes, to += lanes) {
                store_pack(load_pack(&grid.x[o]), &x_[to]);
                store_pack(load_pack(&grid.y[o]), &y_[to]);
                store_pack(load_pack(&grid.z[o]), &z_[to]);
                store_pack(load_pack(&grid.r[o]), &r_[to]);
                store_pack(Numbers{0, 1, 2, 3, 4, 5, 6, 7} + o, &sphere_[to]);
            }
            size_ += run.end - run.begin;
        }
        store_pack(Floats{} + std::numeric_limits<float>::infinity(), &x_[size_]);  // far from everything
    }

    std::uint32_t size() const { return size_; }

    // Calls f(sphere, certain) for the spheres near sphere m of `own`, except for the first `skipped`. The test has
    // single precision; `certain` means that rounding cannot change the answer. Hits are collected for many packs
    // before any is reported, because the number of hits in a pack is unpredictable to the branch predictor.
    template <class F>
    void for_each(const CellGrid& own, std::size_t m, float blur, std::uint32_t skipped, const F& f) const
    {
        const float x = own.x[m], y = own.y[m], z = own.z[m];
        const float most = near_rounding * own.r[m] + blur, least = (2 - near_rounding) * own.r[m] - blur;
        // Each pack has one bit in every byte, and the byte is the lane.
        constexpr std::uint64_t first_bits = 0x0101010101010101;
        std::uint64_t there = first_bits << 8 * (skipped % lanes);
        for (std::uint32_t from = skipped / lanes * lanes; from < size_; from += lanes * lanes) {
            const std::uint32_t end = std::min(size_, from + lanes * lanes);
            std::uint64_t near = 0, certain = 0;
            for (std::uint32_t o = from, bit = 0; o < end; o += lanes, ++bit) {
                const Floats dx = load_pack(&x_[o]) - x, dy = load_pack(&y_[o]) - y, dz = load_pack(&z_[o]) - z;
                const Floats r = load_pack(&r_[o]), d2 = dx * dx + dy * dy + dz * dz;
                const Floats reach = near_rounding * r + most, within = (2 - near_rounding) * r + least;
                const FloatFlags flags = ((d2 < reach * reach) & 1) | ((d2 < within * within) & (within > 0) & 2);
                const auto bytes = std::bit_cast<std::uint64_t>(__builtin_convertvector(flags, LaneBytes));
                near |= (bytes & there) << bit;
                certain |= (bytes >> 1 & there) << bit;
                there = first_bits;
            }
            for (; near != 0; near &= near - 1) {
                const auto at = static_cast<std::uint32_t>(std::countr_zero(near));
                f(sphere_[from + at % 8 * lanes + at / 8], (certain >> at & 1) != 0);
            }
        }
    }

private:
    typedef std::uint32_t Numbers __attribute__((vector_size(4 * lanes)));

    std::vector<float> x_, y_, z_, r_;   // as in the grid
    std::vector<std::uint32_t> sphere_;  // index in the grid
    std::uint32_t size_ = 0;
};

// Sorts short lists of distinct numbers without branches on their values. Branches would be mispredicted, and std::sort
// takes longer to start.

// Longer lists go to std::sort.
constexpr std::uint32_t max_sorted_by_rank = 4 * lanes;

// Writes each number at its rank, the count of smaller numbers.
template <std::uint32_t packs>
inline void sort_by_rank(const std::uint32_t* from, std::uint32_t count, std::uint32_t* to)
{
    typedef std::uint32_t Numbers __attribute__((vector_size(4 * lanes)));
    Numbers all[packs], rank[packs] = {};
    std::memcpy(all, from, sizeof all);
    for (std::uint32_t k = 0; k < count; ++k)
        for (std::uint32_t p = 0; p < packs; ++p) rank[p] -= reinterpret_cast<Numbers>(all[p] > from[k]);
    for (std::uint32_t k = 0; k < count; ++k) to[rank[k / lanes][k % lanes]] = from[k];
}

// from: must be readable for max_sorted_by_rank numbers.
inline void sort_few(const std::uint32_t* from, std::uint32_t count, std::uint32_t* to)
{
    if (count <= lanes) return sort_by_rank<1>(from, count, to);
    if (count <= 2 * lanes) return sort_by_rank<2>(from, count, to);
    if (count <= max_sorted_by_rank) return sort_by_rank<4>(from, count, to);
    std::sort(to, std::copy_n(from, count, to));
}

class Neighbours {
public:
    // P: shape [n], m, copied. radius: query radius, > 0, m. Throws Error if the radius is below 2^-30 of the largest
    // coordinate.
    Neighbours(std::span<const Vec3f> P, double radius);
    Neighbours(const Neighbours&) = delete;
    Neighbours& operator=(const Neighbours&) = delete;

    // Sets `indices` to the points at most the radius from X, ascending. Thread-safe.
    void find(const Vec3d& X, std::vector<std::uint32_t>& indices) const;

    // Calls f(i, others) for each point, on all threads. `others` are the ascending indices of the points within the
    // radius of it, including itself, in a vector that f may modify. Points are visited in cell order, so that
    // neighbourhoods stay in the caches.
    template <class F>
    void for_each(const F& f) const
    {
        for_each_chunk(grid_.size(), [&](std::size_t begin, std::size_t end) {
            NearSpheres spheres;
            std::vector<std::uint32_t> found, near;
            grid_.for_each_stretch(begin, end, [&](std::size_t m, std::size_t last, std::size_t from, std::size_t to) {
                spheres.gather(grid_, grid_.around(grid_.key(from), grid_.key(to)));
                found.resize(std::max<std::size_t>(found.size(), spheres.size() + max_sorted_by_rank));
                for (; m < last; ++m) {
                    list(m, spheres, found, near);
                    f(grid_.index[m], near);
                }
            });
        });
    }

private:
    // found: scratch memory with room for all of the spheres and for sorting.
    void list(std::size_t sphere, const NearSpheres& spheres, std::span<std::uint32_t> found,
              std::vector<std::uint32_t>& near) const;
    bool is_near(std::uint32_t point, const Vec3d& X) const
    {
        return (P_[point] - X).squaredNorm() <= radius_ * radius_;
    }

    PageArray<Vec3d> P_;
    double radius_;
    SpheresView spheres_;  // in units of the radius, so that no radius is too small for single precision
    float blur_ = 0;
    CellGrid grid_;
};

}  // namespace rapid
