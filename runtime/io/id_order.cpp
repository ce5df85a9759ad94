#include "runtime/io/id_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <numeric>
#include <utility>

#include "runtime/base/parallel.h"

namespace rapid {

// Radix sort by digits of eleven bits, least significant first, with as many digits as the ids span.
std::vector<std::size_t> id_order(const Column<std::int64_t>& id)
{
    constexpr int bits = 11;
    constexpr std::size_t values = std::size_t{1} << bits;
    const Strided<std::int64_t> ids = id.read();
    if (id.is_uniform() || std::is_sorted(ids.data, ids.data + id.size())) return {};
    const auto [least, most] = std::minmax_element(ids.data, ids.data + id.size());
    const auto first = static_cast<std::uint64_t>(*least);
    const int width = std::bit_width(static_cast<std::uint64_t>(*most) - first);

    std::vector<std::size_t> order(id.size()), sorted(id.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (int shift = 0; shift < width; shift += bits) {
        const auto digit = [&](std::size_t i) {
            return (static_cast<std::uint64_t>(ids[i]) - first) >> shift & (values - 1);
        };
        std::array<std::size_t, values> next{};
        for (const std::size_t i : order) ++next[digit(i)];
        std::size_t begin = 0;
        for (std::size_t& count : next) begin += std::exchange(count, begin);
        for (const std::size_t i : order) sorted[next[digit(i)]++] = i;
        order.swap(sorted);
    }
    return order;
}

namespace {

template <class T>
Column<T> gathered(const Column<T>& column, const std::vector<std::size_t>& order)
{
    if (column.is_uniform()) return Column<T>(order.size(), column[0], column.fallback());
    Column<T> result(0, column.fallback());
    std::span<T> values = result.append_for_writing(order.size());
    const Strided<T> from = column.read();
    for_each_chunk(order.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) values[i] = from[order[i]];
    });
    return result;
}

}  // namespace

PointSet reordered(const PointSet& points, const std::vector<std::size_t>& order)
{
    if (order.empty()) return points;
    PointSet result;
    result.append(order.size());
    for (const auto& [name, column] : points.columns())
        result.set(name, std::visit([&](const auto& c) -> AnyColumn { return gathered(c, order); }, column));
    for (const auto& [name, members] : points.groups()) result.group(name) = gathered(members, order);
    return result;
}

}  // namespace rapid
