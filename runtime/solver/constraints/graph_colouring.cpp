#include "runtime/solver/constraints/graph_colouring.h"

#include <array>
#include <bit>

namespace rapid {

GraphColouring::GraphColouring(std::span<const std::uint32_t> points, std::size_t arity, std::size_t size)
{
    constexpr std::size_t most = 64;  // bits of a word; only rows of hubs are left over
    const std::size_t rows = points.size() / arity;
    std::vector<std::uint64_t> taken(size);
    std::vector<std::uint8_t> colour(rows);
    std::array<std::uint32_t, most + 2> count{};
    for (std::size_t r = 0; r < rows; ++r) {
        const std::span<const std::uint32_t> of_row = points.subspan(r * arity, arity);
        std::uint64_t all = 0;
        for (const std::uint32_t i : of_row) all |= taken[i];
        const int first = std::countr_one(all);
        colour[r] = static_cast<std::uint8_t>(first);
        ++count[static_cast<std::size_t>(first) + 1];
        if (first < static_cast<int>(most))
            for (const std::uint32_t i : of_row) taken[i] |= std::uint64_t{1} << first;
    }
    uncoloured = count[most + 1];
    for (std::size_t c = 0; c <= most; ++c) count[c + 1] += count[c];
    begin.push_back(0);
    for (std::size_t c = 0; c < most && count[c] < rows - uncoloured; ++c) begin.push_back(count[c + 1]);
    order.resize(rows);
    for (std::size_t r = 0; r < rows; ++r) order[count[colour[r]]++] = static_cast<std::uint32_t>(r);
}

}  // namespace rapid
