#include "runtime/solver/constraints/forest.h"

#include <algorithm>
#include <numeric>

namespace rapid {
namespace {

// Which points are connected; the least place of each part stands for it.
class Parts {
public:
    explicit Parts(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0u); }

    std::uint32_t of(std::uint32_t i)
    {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    bool join(std::uint32_t i, std::uint32_t j)
    {
        i = of(i), j = of(j);
        if (i == j) return false;
        parent_[std::max(i, j)] = std::min(i, j);
        return true;
    }

private:
    std::vector<std::uint32_t> parent_;
};

}  // namespace

Forest::Forest(std::span<const std::uint32_t> ends, std::size_t size, std::span<const std::uint8_t> fixed)
{
    const std::size_t rows = ends.size() / 2;
    Parts parts(size);
    std::vector<std::uint32_t> closing;
    for (std::uint32_t r = 0; r < rows; ++r)
        if (!parts.join(ends[2 * r], ends[2 * r + 1])) closing.push_back(ends[2 * r]);
    std::vector<std::uint8_t> cyclic(size);
    for (const std::uint32_t i : closing) cyclic[parts.of(i)] = 1;

    // The rows at each point.
    std::vector<std::uint32_t> first(size + 1), row_at(2 * rows);
    for (const std::uint32_t i : ends) ++first[i + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> next = first;
    for (std::uint32_t r = 0; r < rows; ++r) {
        if (cyclic[parts.of(ends[2 * r])]) {
            leftover.push_back(r);
            continue;
        }
        row_at[next[ends[2 * r]]++] = r;
        row_at[next[ends[2 * r + 1]]++] = r;
    }

    begin.push_back(0);
    std::vector<std::uint8_t> seen(size);
    std::vector<std::uint32_t> own(size);  // the link to a point's parent
    const auto grow = [&](std::uint32_t root) {
        if (seen[root] || first[root] == next[root]) return;
        seen[root] = 1;
        const auto branch = [&](std::uint32_t parent, bool at_root) {
            for (std::uint32_t k = first[parent]; k < next[parent]; ++k) {
                const std::uint32_t r = row_at[k];
                const bool flipped = ends[2 * r + 1] == parent;
                const std::uint32_t child = ends[2 * r + (flipped ? 0 : 1)];
                if (seen[child]) continue;
                seen[child] = 1;
                own[child] = static_cast<std::uint32_t>(links.size());
                Link link{};
                link.row = r, link.child = child, link.parent = parent, link.flipped = flipped;
                link.above = at_root ? own[child] : own[parent];
                links.push_back(link);
            }
        };
        branch(root, true);
        for (std::size_t k = begin.back(); k < links.size(); ++k) branch(links[k].child, false);
        begin.push_back(static_cast<std::uint32_t>(links.size()));
    };
    for (std::uint32_t i = 0; i < size; ++i)
        if (fixed[i]) grow(i);
    for (std::uint32_t i = 0; i < size; ++i) grow(i);
}

}  // namespace rapid
