// Checks on lists from a snapshot before they are used as indices (StateReader::expect).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace rapid {

inline bool are_below(std::span<const std::uint32_t> list, std::size_t limit)
{
    return std::all_of(list.begin(), list.end(), [&](std::uint32_t i) { return i < limit; });
}
inline bool are_below(const std::vector<std::array<std::uint32_t, 2>>& list, std::size_t limit)
{
    return std::all_of(list.begin(), list.end(), [&](const auto& pair) { return are_below(pair, limit); });
}

// Returns true if `begin` has the offset of each of `lists` lists within `total` elements, followed by the end.
inline bool are_offsets(const std::vector<std::uint32_t>& begin, std::size_t lists, std::size_t total)
{
    return begin.size() == lists + 1 && begin.front() == 0 && begin.back() == total &&
           std::is_sorted(begin.begin(), begin.end());
}

// Returns true if the ids strictly ascend.
inline bool ascend(std::span<const std::int64_t> ids)
{
    return std::adjacent_find(ids.begin(), ids.end(), std::greater_equal<>()) == ids.end();
}

inline bool is_between(double x, double least, double most) { return least <= x && x <= most; }  // false for NaN

}  // namespace rapid
