#include "runtime/io/id_order.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <numeric>

#include "runtime/parallel.h"

namespace rapid {

std::vector<std::size_t> id_order(const Column<std::int64_t>& id)
{
    const Strided<std::int64_t> ids = id.read();
    if (id.is_uniform() || std::is_sorted(ids.data, ids.data + id.size())) return {};
    std::vector<std::size_t> order(id.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    // With the place as the second key the order is total, so that a parallel sort has one result.
    tbb::parallel_sort(order.begin(), order.end(),
                       [&](std::size_t a, std::size_t b) { return ids[a] != ids[b] ? ids[a] < ids[b] : a < b; });
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
