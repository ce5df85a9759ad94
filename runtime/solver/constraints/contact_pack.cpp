#include "runtime/solver/constraints/contact_pack.h"

namespace rapid {

// Each pair goes into the first pack with room after those that contain its points, so the result equals solving one
// pair after the other, in order. A window of 64 packs is open. A pair that fits into none of them starts the next
// window, which bounds the time to find a pack.
void ContactPacks::pack(std::size_t block, std::span<const std::uint32_t> pairs, std::span<const ContactPair> all)
{
    std::vector<ContactPack>& packs = packs_[block];
    packs.clear();
    std::uint32_t window = 0;  // the window's number: 1 more than that of its first pair
    std::uint64_t room = 0;    // bit mask of its packs with room
    std::size_t first = 0;
    for (const std::uint32_t k : pairs) {
        const auto [i, j] = all[k];
        Open &a = last_[i], &b = last_[j];
        const std::uint64_t taken = (a.window == window ? a.packs : 0) | (b.window == window ? b.packs : 0);
        std::uint64_t free = room & ~taken;
        if (free == 0) {
            window = k + 1;
            first = packs.size();
            free = room = ~std::uint64_t{0};
        }
        const auto p = static_cast<std::size_t>(std::countr_zero(free));
        if (first + p == packs.size()) packs.emplace_back().count = 0;
        ContactPack& pack = packs[first + p];
        const std::uint32_t l = pack.count++;
        pack.i[l] = i, pack.j[l] = j, pack.pair[l] = k;
        if (pack.count == lanes) room &= ~(std::uint64_t{1} << p);
        // Assign the members one by one: reading both with one wide load after two narrow stores would stall.
        a.window = b.window = window;
        a.packs = b.packs = (std::uint64_t{2} << p) - 1;
    }
    for (ContactPack& pack : packs) pack.repeat_first();
}

}  // namespace rapid
