// Which spheres of some runs of cells touch one, of their grid or of another: eight at a time, in single precision.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "runtime/points/cell_grid.h"
#include "runtime/simd.h"

namespace rapid {

// A sum of radii in single precision, with room for the rounding of what it is compared with.
constexpr float near_rounding = 1 + 0x1p-20f;

// The rounding of the distance of two places in single precision, m; extent: m, how far they are from the middle.
inline float near_blur(double extent) { return static_cast<float>(2 * (0x1p-22 * extent)); }

// Calls f(sphere, certain) for the spheres of some runs of `grid` that are near the sphere m of `own`, in single
// precision. All are tested before any is reported: the number of hits in a run can't be predicted.
template <class Ranges, class F>
inline void for_near_spheres(const CellGrid& own, std::size_t m, const CellGrid& grid, const Ranges& runs, float blur,
                             const F& f)
{
    const float x = own.x[m], y = own.y[m], z = own.z[m];
    const float most = near_rounding * own.r[m] + blur, least = (2 - near_rounding) * own.r[m] - blur;
    // Of each group of eight a bit in every byte, which is the lane's.
    constexpr std::uint64_t first_bits = 0x0101010101010101;
    std::uint64_t near = 0, certain = 0;
    std::uint32_t start[8];
    std::uint32_t groups = 0;
    const auto report = [&] {
        for (; near != 0; near &= near - 1) {
            const auto at = static_cast<std::uint32_t>(std::countr_zero(near));
            f(start[at % 8] + at / 8, (certain >> at & 1) != 0);
        }
        certain = 0;
        groups = 0;
    };
    for (const auto& run : runs) {
        std::uint32_t o = run.begin;
        do {
            const Floats dx = load_pack(&grid.x[o]) - x, dy = load_pack(&grid.y[o]) - y, dz = load_pack(&grid.z[o]) - z;
            const Floats r = load_pack(&grid.r[o]), d2 = dx * dx + dy * dy + dz * dz;
            const Floats reach = near_rounding * r + most, within = (2 - near_rounding) * r + least;
            const FloatFlags flags = ((d2 < reach * reach) & 1) | ((d2 < within * within) & (within > 0) & 2);
            const auto bytes = std::bit_cast<std::uint64_t>(__builtin_convertvector(flags, LaneBytes));
            const std::uint32_t count = std::min<std::uint32_t>(lanes, run.end - o);
            const std::uint64_t there =
                first_bits & (count == lanes ? ~std::uint64_t{0} : (std::uint64_t{1} << 8 * count) - 1);
            near |= (bytes & there) << groups;
            certain |= (bytes >> 1 & there) << groups;
            start[groups++] = o;
            if (groups == 8) report();
            o += lanes;
        } while (o < run.end);
    }
    report();
}

}  // namespace rapid
