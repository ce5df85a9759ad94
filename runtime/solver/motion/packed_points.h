// The coordinates of eight points in memory order, x y z x y z ..., in three packs. Loops over them need no
// transposition, and values of an axis recur in the same lanes.
#pragma once

#include <cstdint>

#include "runtime/math/simd.h"
#include "runtime/math/vec.h"

namespace rapid {

constexpr std::uint32_t coordinates_per_pack = 3 * lanes;

template <class Pack>
struct alignas(sizeof(Pack)) PackedPoints {
    Pack part[3];

    Pack& operator[](std::uint32_t k) { return part[k]; }
    const Pack& operator[](std::uint32_t k) const { return part[k]; }

    // Sets coordinate l of 24.
    void set(std::uint32_t l, double value) { part[l / lanes][l % lanes] = value; }
    // Sets all three coordinates of a point to the same value.
    void set_point(std::uint32_t point, double value)
    {
        for (std::uint32_t l = 3 * point; l < 3 * point + 3; ++l) set(l, value);
    }
};

// Returns the same vector for each of the eight points.
inline PackedPoints<Doubles> repeated(const Vec3d& x)
{
    PackedPoints<Doubles> all;
    for (std::uint32_t l = 0; l < coordinates_per_pack; ++l) all.set(l, x[l % 3]);
    return all;
}

// Mask with bit 3 p for each point p.
constexpr std::uint32_t every_point = 0x249249;

// Reduces one bit per coordinate to bit 3 p for each point p with any bit set.
[[gnu::always_inline]] inline std::uint32_t any_of_point(std::uint32_t coordinates)
{
    return (coordinates | coordinates >> 1 | coordinates >> 2) & every_point;
}

}  // namespace rapid
