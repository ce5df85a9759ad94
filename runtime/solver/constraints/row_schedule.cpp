#include "runtime/solver/constraints/row_schedule.h"

#include <array>
#include <bit>
#include <numeric>

#include "runtime/solver/constraints/disjoint_sets.h"

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

// The rows at each point, and the state of the traversal.
struct Forest::Incidence {
    std::vector<std::uint32_t> begin, end, row;  // row[begin[i]] to row[end[i]] are those at i
    std::vector<std::uint8_t> visited;
    std::vector<std::uint32_t> own;  // the link to a point's parent
};

Forest::Forest(std::span<const std::uint32_t> ends, std::size_t size, std::span<const std::uint8_t> fixed)
{
    const std::size_t rows = ends.size() / 2;
    DisjointSets components(size);
    std::vector<std::uint32_t> closing;  // one point of each row that closes a cycle
    for (std::uint32_t r = 0; r < rows; ++r)
        if (!components.join(ends[2 * r], ends[2 * r + 1])) closing.push_back(ends[2 * r]);
    std::vector<std::uint8_t> cyclic(size);
    for (const std::uint32_t i : closing) cyclic[components.root(i)] = 1;

    std::vector<std::uint32_t> first(size + 1), row_at(2 * rows);
    for (const std::uint32_t i : ends) ++first[i + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> next = first;
    for (std::uint32_t r = 0; r < rows; ++r) {
        if (cyclic[components.root(ends[2 * r])]) {
            leftover.push_back(r);
            continue;
        }
        row_at[next[ends[2 * r]]++] = r;
        row_at[next[ends[2 * r + 1]]++] = r;
    }

    Incidence incidence{std::move(first), std::move(next), std::move(row_at), std::vector<std::uint8_t>(size),
                        std::vector<std::uint32_t>(size)};
    begin.push_back(0);
    for (std::uint32_t i = 0; i < size; ++i)
        if (fixed[i]) grow(i, ends, incidence);
    for (std::uint32_t i = 0; i < size; ++i) grow(i, ends, incidence);
}

// Adds the tree with this root, breadth first.
void Forest::grow(std::uint32_t root, std::span<const std::uint32_t> ends, Incidence& at)
{
    if (at.visited[root] || at.begin[root] == at.end[root]) return;
    at.visited[root] = 1;
    const auto branch = [&](std::uint32_t parent, bool at_root) {
        for (std::uint32_t k = at.begin[parent]; k < at.end[parent]; ++k) {
            const std::uint32_t r = at.row[k];
            const bool flipped = ends[2 * r + 1] == parent;
            const std::uint32_t child = ends[2 * r + (flipped ? 0 : 1)];
            if (at.visited[child]) continue;
            at.visited[child] = 1;
            at.own[child] = static_cast<std::uint32_t>(links.size());
            Link link{};
            link.row = r, link.child = child, link.parent = parent, link.flipped = flipped;
            link.above = at_root ? at.own[child] : at.own[parent];
            links.push_back(link);
        }
    };
    branch(root, true);
    for (std::size_t k = begin.back(); k < links.size(); ++k) branch(links[k].child, false);
    begin.push_back(static_cast<std::uint32_t>(links.size()));
}

}  // namespace rapid
