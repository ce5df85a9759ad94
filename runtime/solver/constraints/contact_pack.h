// Contacts in packs of eight that share no point, so that all of a pack are solved at once.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/math/simd.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/pair_impulses.h"

namespace rapid {

// Projected points in SIMD packs of eight.

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

// One contact per lane. Lanes from `count` on repeat the first, and their results are dropped.
struct alignas(64) ContactPack {
    Indices i, j, pair;
    std::uint32_t count;
    Floats reach;                        // m: r_i + r_j
    Floats initial_gap;                  // m: C at the beginning of the substep, at most 0
    Floats normal_impulse;               // N s along n: first for the projection of positions, then the total
    Floats carried_impulse;              // N s along n: given by the warm start to velocities only
    Floats friction;                     // μ
    Floats restitution;                  // ε
    Floats effective_mass;               // kg: 1 / (w_i + w_j)
    Floats scale;                        // mass scaling multiplies w_i and divides w_j by this
    Vectors<Floats> n;                   // from j to i, unit
    Vectors<Floats> tangential_impulse;  // N s, across n

    void repeat_first()
    {
        for (std::uint32_t l = count; l < lanes; ++l) i[l] = i[0], j[l] = j[0], pair[l] = pair[0];
    }
};

// One contact of a pack.
struct PairContact {
    std::uint32_t i, j, pair;
    double reach, initial_gap;
    Vec3d n;
};

template <class F>
void for_each_contact(const ContactPack& pack, const F& f)
{
    for (std::uint32_t l = 0; l < pack.count; ++l)
        f(PairContact{pack.i[l], pack.j[l], pack.pair[l], pack.reach[l], pack.initial_gap[l], pack.n[l]});
}

// The contacts of a substep, block by block.
class ContactPacks {
public:
    void resize(std::size_t blocks)
    {
        size_ = blocks;
        if (packs_.size() < blocks) packs_.resize(blocks);
    }
    std::vector<ContactPack>& operator[](std::size_t block) { return packs_[block]; }

    // Calls f for each contact, on one thread.
    template <class F>
    void for_each(const F& f) const
    {
        for (std::size_t b = 0; b < size_; ++b)
            for (const ContactPack& pack : packs_[b]) for_each_contact(pack, f);
    }

    // Starts packing; points: number of points in the set.
    void begin(std::size_t points) { last_.assign(points, {}); }
    // Packs the pairs of a block, given as indices in `all`. Blocks that share no point may be packed concurrently.
    void pack(std::size_t block, std::span<const std::uint32_t> pairs, std::span<const ContactPair> all);

private:
    std::size_t size_ = 0;
    std::vector<std::vector<ContactPack>> packs_;  // entries from size_ on keep their memory for reuse

    // For each point: a bit mask of the open packs up to the last one with the point, valid for this window.
    struct Open {
        std::uint32_t window = 0;
        std::uint64_t packs = 0;
    };
    std::vector<Open> last_;
};

}  // namespace rapid
