// Which spheres of some runs of cells touch one, of their grid or of another: eight at a time, in single precision.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

#include "runtime/points/cell_grid.h"
#include "runtime/simd.h"

namespace rapid {

// A sum of radii in single precision, with room for the rounding of what it is compared with.
constexpr float near_rounding = 1 + 0x1p-20f;

// The rounding of the distance of two places in single precision; extent: how far they are from the middle.
inline float near_blur(double extent) { return static_cast<float>(2 * (0x1p-22 * extent)); }

// The spheres of some runs, copied side by side: runs are shorter than a pack, mostly, and are looked through once for
// each sphere of a cell.
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
        store_pack(Floats{} + std::numeric_limits<float>::infinity(), &x_[size_]);  // near nothing
    }

    std::uint32_t size() const { return size_; }

    // Calls f(sphere, certain) for those that are near the sphere m of `own`, in single precision, but for the first
    // `skipped`. Many are tested before any is reported: the number of hits in a pack can't be predicted.
    template <class F>
    void for_each(const CellGrid& own, std::size_t m, float blur, std::uint32_t skipped, const F& f) const
    {
        const float x = own.x[m], y = own.y[m], z = own.z[m];
        const float most = near_rounding * own.r[m] + blur, least = (2 - near_rounding) * own.r[m] - blur;
        // Of each pack a bit in every byte, which is the lane's.
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
    std::vector<std::uint32_t> sphere_;  // of the grid
    std::uint32_t size_ = 0;
};

}  // namespace rapid
