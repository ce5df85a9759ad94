// The Gauss-Seidel order of contact pairs: by blocks of space, in eight colours.
//
// A pair belongs to the block of its points or, if they differ, to the lowest of their blocks along each axis. It
// therefore touches only points of that block and its successors. Blocks of one colour are two apart along some axis
// and share no point, so they are solved in parallel, bit-identically for any number of threads. Pairs that are not in
// the list form a block and a colour of their own.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/base/cancellation.h"
#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/neighbour_list.h"
#include "runtime/solver/constraints/pair_impulses.h"

namespace rapid {

class PairBlocks {
public:
    // Orders the listed pairs colour by colour, block by block.
    void build(const NeighbourList& list, std::vector<ContactPair>& ordered);
    // Sets the number of pairs that follow the listed ones, replacing the earlier number.
    void set_unlisted(std::size_t pairs);
    void clear();

    std::size_t size() const { return begin_.size() - 1; }
    std::uint32_t begin(std::size_t block) const { return begin_[block]; }
    std::uint32_t end(std::size_t block) const { return begin_[block + 1]; }
    // The index of each listed pair in the ordered ones.
    std::span<const std::uint32_t> slots() const { return slot_; }

    // Calls f(block) for all blocks, in parallel within a colour.
    template <class F>
    void for_each_coloured(bool backwards, const F& f) const
    {
        const std::size_t colours = colours_.empty() ? 0 : colours_.size() - 1;
        for (std::size_t k = 0; k < colours; ++k) {
            Cancellation::check_current();
            const std::size_t c = backwards ? colours - 1 - k : k;
            run(colours_[c], colours_[c + 1], f);
        }
    }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(begin_, colours_, some_unlisted_);
        if constexpr (Archive::is_loading::value) StateReader::expect(!begin_.empty());
    }
    // Check a loaded snapshot: are_of() returns true if the blocks hold this number of pairs, in colours;
    // have_listed() if this number of pairs is listed.
    bool are_of(std::size_t pairs) const;
    bool have_listed(std::size_t pairs) const;

private:
    template <class F>
    void run(std::size_t from, std::size_t to, const F& f) const
    {
        constexpr std::size_t worth_a_task = 2048;  // pairs: tens of microseconds
        const std::size_t pairs = begin_[to] - begin_[from];
        if (pairs < worth_a_task) {
            for (std::size_t b = from; b < to; ++b) f(b);
            return;
        }
        const std::size_t grain = std::max<std::size_t>(1, (to - from) * worth_a_task / (2 * pairs));
        tbb::parallel_for(tbb::blocked_range<std::size_t>(from, to, grain),
                          [&](const tbb::blocked_range<std::size_t>& range) {
                              for (std::size_t b = range.begin(); b < range.end(); ++b) f(b);
                          });
    }
    void find_owners(const NeighbourList& list);
    void begin_blocks();
    void take_turns(std::size_t block, const Pairs& pairs, std::span<ContactPair> ordered);

    std::vector<std::uint32_t> begin_{0};  // index of each block's first pair, then the end
    std::vector<std::uint32_t> colours_;   // the first block of each colour, then the end
    std::vector<std::uint32_t> slot_;
    bool some_unlisted_ = false;

    // Used during construction.
    std::vector<std::uint16_t> owner_;  // block of each pair, counting empty blocks
    std::vector<std::uint32_t> next_;   // index of the next pair of each of these blocks
    struct PointAndPair {
        std::uint32_t point, pair;
    };
    std::vector<PointAndPair> by_block_;
};

}  // namespace rapid
