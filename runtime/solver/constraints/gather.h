// Eight places of points that are coupled, loaded into and stored from vectors.
#pragma once

#include "runtime/simd.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// Eight places, with their inverse masses.
struct Places {
    Vectors<Doubles> P;
    Doubles w;
};

[[gnu::always_inline]] inline Places gather(std::span<const Place> at, const Indices& i)
{
    const auto c = detail::gathered([&](std::uint32_t l) __attribute__((always_inline)) {
        detail::Four row;
        std::memcpy(&row, &at[i[l]], sizeof row);
        return row;
    });
    return {{c.x, c.y, c.z}, c.w};
}

// Of the first `count` lanes.
[[gnu::always_inline]] inline void scatter(const Places& places, std::span<Place> at, const Indices& i,
                                           std::uint32_t count)
{
    detail::store_rows(
        {places.P.x, places.P.y, places.P.z, places.w},
        count, [&](std::uint32_t l, const auto& row) __attribute__((always_inline)) {
            std::memcpy(static_cast<void*>(&at[i[l]]), &row, sizeof(Place));
        });
}

}  // namespace rapid
