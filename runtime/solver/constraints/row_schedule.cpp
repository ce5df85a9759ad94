#include "runtime/solver/constraints/row_schedule.h"

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

RowSchedule::RowSchedule(std::span<const std::uint32_t> rows, std::span<const std::uint32_t> points, std::size_t arity,
                         std::span<const std::uint8_t> fixed, bool trees)
{
    std::vector<std::uint32_t> points_left(points.begin(), points.end());
    others_.assign(rows.begin(), rows.end());
    if (trees) {
        forest_ = Forest(points, fixed.size(), fixed);
        for (Forest::Link& link : forest_.links) link.row = rows[link.row];
        others_.clear();
        points_left.clear();
        for (const std::uint32_t r : forest_.leftover) {
            others_.push_back(rows[r]);
            for (std::size_t k = 0; k < arity; ++k) points_left.push_back(points[r * arity + k]);
        }
    }
    colours_ = GraphColouring(points_left, arity, fixed.size());
}

}  // namespace rapid
