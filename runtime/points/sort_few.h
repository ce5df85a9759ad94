// Sorts short lists of distinct numbers without branches on their values. Branches would be mispredicted, and std::sort
// takes longer to start.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "runtime/math/simd.h"

namespace rapid {

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

}  // namespace rapid
