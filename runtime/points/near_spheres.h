// Finds the spheres in some runs of cells that touch a given sphere, eight at a time in single precision.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

#include "runtime/math/simd.h"
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

}  // namespace rapid
