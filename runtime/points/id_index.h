// Where the points of a set are, by id.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "runtime/points/column.h"

namespace rapid {

// The first place from `begin` on with an id that is not below another; `end` where there is none. The ids between
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

    // The place of the point of this id; none where no point has it.
    std::uint32_t operator[](std::int64_t id) const;

private:
    std::uint32_t find_ascending(std::int64_t id) const;

    Strided<std::int64_t> ids_;
    std::size_t size_;
    std::vector<std::pair<std::int64_t, std::uint32_t>> sorted_;  // empty where the ids ascend already
};

}  // namespace rapid
