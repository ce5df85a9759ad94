#include "runtime/solver/constraints/forest.h"

#include <numeric>

#include "runtime/solver/constraints/disjoint_sets.h"

namespace rapid {

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
