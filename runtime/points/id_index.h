// Maps point ids to indices in a set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "runtime/points/column.h"

namespace rapid {

// Returns the first index in [begin, end) whose id is not below `id`, or `end` if there is none. Ids in the range
// ascend.
inline std::size_t first_not_below(const Strided<std::int64_t>& ids, std::size_t begin, std::size_t end,
                                   std::int64_t id)
{
    while (begin < end) {
        const std::size_t middle = begin + (end - begin) / 2;
        if (ids[middle] < id)
            begin = middle + 1;
        else
            end = middle;
    }
    return begin;
}

class IdIndex {
public:
    static constexpr std::uint32_t none = UINT32_MAX;

    // Valid until the column is written or moved.
    explicit IdIndex(const Column<std::int64_t>& ids);

    // Returns the index of the point with this id, or `none`.
    std::uint32_t operator[](std::int64_t id) const;

private:
    std::uint32_t find_ascending(std::int64_t id) const;

    Strided<std::int64_t> ids_;
    std::size_t size_;
    std::vector<std::pair<std::int64_t, std::uint32_t>> sorted_;  // empty if the ids already ascend
};

}  // namespace rapid
