// The births of a frame that are computed: all, or those of a subset of the points.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/items.h"
#include "runtime/operators/emit/births.h"
#include "runtime/points/subset.h"

namespace rapid {

// Births of a frame, or those among them that a subset has.
struct Chosen {
    const Births& births;
    std::vector<std::uint32_t> places;  // in the frame, of those that a subset has
    bool are_all;

    std::size_t size() const { return are_all ? births.count : places.size(); }
    // From the first-th of them on: their numbers among the births of the frame, and of the emitter.
    Items in_frame(std::size_t first) const { return items(0, first); }
    Items numbers(std::size_t first) const { return items(births.first, first); }

private:
    Items items(std::uint64_t base, std::size_t first) const
    {
        return are_all ? Items(base + first) : Items(base, places.data() + first);
    }
};

// next_id: of the first.
inline Chosen choose(const Births& births, const Subset& subset, std::int64_t next_id)
{
    Chosen chosen{births, {}, subset.is_all()};
    if (chosen.are_all) return chosen;
    for (std::size_t i = 0; i < births.count; ++i)
        if (subset.has(next_id + static_cast<std::int64_t>(i))) chosen.places.push_back(static_cast<std::uint32_t>(i));
    return chosen;
}

}  // namespace rapid
