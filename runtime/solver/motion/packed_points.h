// The coordinates of eight points as they lie in memory, x y z x y z ..., in three packs: loops over them need no
// transposition, and what belongs to an axis recurs in the same lanes.
#pragma once

#include <cstdint>

#include "runtime/simd.h"
#include "runtime/vec.h"

namespace rapid {

constexpr std::uint32_t coordinates_per_pack = 3 * lanes;

template <class Pack>
struct alignas(sizeof(Pack)) PackedPoints {
    Pack part[3];

    Pack& operator[](std::uint32_t k) { return part[k]; }
    const Pack& operator[](std::uint32_t k) const { return part[k]; }

    // The coordinate l of 24.
    void set(std::uint32_t l, double value) { part[l / lanes][l % lanes] = value; }
    // The same value for all three coordinates of a point.
    void set_point(std::uint32_t point, double value)
    {
        for (std::uint32_t l = 3 * point; l < 3 * point + 3; ++l) set(l, value);
    }
};

// The same vector for each of the eight points.
inline PackedPoints<Doubles> repeated(const Vec3d& x)
{
    PackedPoints<Doubles> all;
    for (std::uint32_t l = 0; l < coordinates_per_pack; ++l) all.set(l, x[l % 3]);
    return all;
}

// Bit 3 p of each point p.
constexpr std::uint32_t every_point = 0x249249;

// Of one bit per coordinate, bit 3 p for each point p of which one is set.
[[gnu::always_inline]] inline std::uint32_t any_of_point(std::uint32_t coordinates)
{
    return (coordinates | coordinates >> 1 | coordinates >> 2) & every_point;
}

}  // namespace rapid
