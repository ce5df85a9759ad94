// Projected points in SIMD packs of eight.
#pragma once

#include "runtime/simd.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// Eight positions with their inverse masses.
struct alignas(sizeof(Doubles)) PointPack {
    Vectors<Doubles> P;
    Doubles w;
};

[[gnu::always_inline]] inline PointPack gather(std::span<const ProjectedPoint> at, const Indices& i)
{
    const auto c = detail::gathered([&](std::uint32_t l) __attribute__((always_inline)) {
        detail::Four row;
        std::memcpy(&row, &at[i[l]], sizeof row);
        return row;
    });
    return {{c.x, c.y, c.z}, c.w};
}

// Stores the first `count` lanes.
[[gnu::always_inline]] inline void scatter(const PointPack& pack, std::span<ProjectedPoint> at, const Indices& i,
                                           std::uint32_t count)
{
    detail::store_rows(
        {pack.P.x, pack.P.y, pack.P.z, pack.w},
        count, [&](std::uint32_t l, const auto& row) __attribute__((always_inline)) {
            std::memcpy(static_cast<void*>(&at[i[l]]), &row, sizeof(ProjectedPoint));
        });
}

}  // namespace rapid
