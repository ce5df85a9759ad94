#include "runtime/solver/constraints/pair_blocks.h"

#include <array>
#include <numeric>

#include "runtime/base/parallel.h"
#include "runtime/base/per_thread.h"
#include "runtime/points/state_archive.h"

namespace rapid {
namespace {

// Blocks that are 32 apart along an axis count as the same block, so each colour has 16 along each axis.
constexpr std::size_t blocks_per_colour = 16 * 16 * 16, blocks = 8 * blocks_per_colour;

constexpr std::size_t points_per_task = 2048;  // with their pairs: tens of microseconds

}  // namespace

void PairBlocks::clear()
{
    begin_.assign(1, 0);
    colours_.clear();
    some_unlisted_ = false;
}

void PairBlocks::set_unlisted(std::size_t pairs)
{
    if (some_unlisted_) begin_.pop_back(), colours_.pop_back();
    some_unlisted_ = pairs > 0;
    if (!some_unlisted_) return;
    begin_.push_back(begin_.back() + static_cast<std::uint32_t>(pairs));
    colours_.push_back(static_cast<std::uint32_t>(size()));
}

bool PairBlocks::are_of(std::size_t pairs) const
{
    return are_offsets(begin_, size(), pairs) &&
           (colours_.empty() ? size() == 0 : are_offsets(colours_, colours_.size() - 1, size()));
}

bool PairBlocks::have_listed(std::size_t pairs) const
{
    if (!some_unlisted_) return begin_.back() == pairs;
    return colours_.size() > 1 && colours_[colours_.size() - 2] + 1 == size() && begin_[size() - 1] == pairs;
}

void PairBlocks::build(const NeighbourList& list, std::vector<ContactPair>& ordered)
{
    const Pairs& pairs = list.pairs();
    const std::size_t n = pairs.begin.size() - 1, m = pairs.size();
    find_owners(list);
    begin_blocks();
    by_block_.resize(m);
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t k = pairs.begin[i]; k < pairs.begin[i + 1]; ++k) by_block_[next_[owner_[k]]++] = {i, k};
    ordered.resize(m);
    slot_.resize(m);
    run(0, size(), [&](std::size_t b) { take_turns(b, pairs, ordered); });
}

void PairBlocks::find_owners(const NeighbourList& list)
{
    const Pairs& pairs = list.pairs();
    owner_.resize(pairs.size());
    const auto find = [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            for (std::uint32_t k = pairs.begin[i]; k < pairs.begin[i + 1]; ++k) {
                const auto &a = list.block(i), &b = list.block(pairs.other[k]);
                std::uint32_t colour = 0, place = 0;
                for (int axis = 2; axis >= 0; --axis) {
                    const auto least = static_cast<std::uint32_t>(std::min(a[axis], b[axis]));
                    colour = colour << 1 | (least & 1);
                    place = place << 4 | (least >> 1 & 15);
                }
                owner_[k] = static_cast<std::uint16_t>(colour << 12 | place);
            }
    };
    for_each_chunk(pairs.begin.size() - 1, find, points_per_task);
}

void PairBlocks::begin_blocks()
{
    next_.assign(blocks + 1, 0);
    for (const std::uint16_t owner : owner_) ++next_[owner + 1];
    std::partial_sum(next_.begin(), next_.end(), next_.begin());
    begin_.clear();
    colours_.clear();
    some_unlisted_ = false;
    for (std::size_t b = 0; b < blocks; ++b) {
        if (b % blocks_per_colour == 0) colours_.push_back(static_cast<std::uint32_t>(begin_.size()));
        if (next_[b] < next_[b + 1]) begin_.push_back(next_[b]);
    }
    colours_.push_back(static_cast<std::uint32_t>(begin_.size()));
    begin_.push_back(static_cast<std::uint32_t>(owner_.size()));
}

// Orders a block by taking the first pairs of all points, then the second, and so on. Consecutive pairs then seldom
// share a point, so the processor can overlap them.
void PairBlocks::take_turns(std::size_t block, const Pairs& pairs, std::span<ContactPair> ordered)
{
    thread_local PerThread<std::vector<std::array<std::uint32_t, 2>>> kept;
    std::vector<std::array<std::uint32_t, 2>>& remaining = *kept;  // the remaining pairs of each point
    const std::uint32_t first = begin_[block], last = begin_[block + 1];
    remaining.clear();
    for (std::uint32_t t = first; t < last; ++t) {
        if (t == first || by_block_[t].point != by_block_[t - 1].point) remaining.push_back({t, t});
        remaining.back()[1] = t + 1;
    }
    std::uint32_t slot = first;
    while (!remaining.empty()) {
        std::size_t left = 0;
        for (auto [t, end] : remaining) {
            const auto [i, k] = by_block_[t];
            slot_[k] = slot;
            ordered[slot++] = {i, pairs.other[k]};
            remaining[left] = {t + 1, end};
            left += t + 1 < end;
        }
        remaining.resize(left);
    }
}

}  // namespace rapid
