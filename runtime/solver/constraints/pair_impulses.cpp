#include "runtime/solver/constraints/pair_impulses.h"

#include <algorithm>

#include "runtime/base/parallel.h"
#include "runtime/points/id_index.h"

namespace rapid {
namespace {

// Counts the values below `value`. Most lists are short, and counting them avoids a mispredicted branch.
std::size_t count_below(std::span<const std::uint32_t> ascending, std::uint32_t value)
{
    constexpr std::size_t few = 32;
    if (ascending.size() > few)
        return static_cast<std::size_t>(std::lower_bound(ascending.begin(), ascending.end(), value) -
                                        ascending.begin());
    std::size_t below = 0;
    for (const std::uint32_t x : ascending) below += x < value;
    return below;
}

}  // namespace

void PairImpulses::scale(float factor)
{
    for (float& impulse : normal) impulse *= factor;
    for (Vec3f& impulse : tangential) impulse *= factor;
    for (Vec3f& impulse : resting) impulse *= factor;
    for (Vec3f& impulse : rolling) impulse *= factor;
}

void PairImpulses::renumber(std::span<const std::uint32_t> index, std::vector<std::uint32_t>& orphans)
{
    struct Kept {
        ContactPair pair;
        float normal;
        Vec3f tangential, resting, rolling;
    };
    std::vector<Kept> kept;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        if (!(normal[k] > 0)) continue;
        const std::uint32_t i = index[pairs[k][0]], j = index[pairs[k][1]];
        if (i == IdIndex::none && j != IdIndex::none) orphans.push_back(j);
        if (j == IdIndex::none && i != IdIndex::none) orphans.push_back(i);
        if (i == IdIndex::none || j == IdIndex::none) continue;
        const float sign = i > j ? -1.0f : 1.0f;
        const Vec3f rested = resting.empty() ? Vec3f(Vec3f::Zero()) : resting[k];
        const Vec3f rolled = rolling.empty() ? Vec3f(Vec3f::Zero()) : rolling[k];
        kept.push_back(
            {{std::min(i, j), std::max(i, j)}, normal[k], sign * tangential[k], sign * rested, sign * rolled});
    }
    std::sort(kept.begin(), kept.end(), [](const Kept& a, const Kept& b) { return a.pair < b.pair; });
    const bool some_resting = !resting.empty(), some_rolling = !rolling.empty();
    *this = {};
    for (const Kept& k : kept) {
        pairs.push_back(k.pair);
        normal.push_back(k.normal);
        tangential.push_back(k.tangential);
        if (some_resting) resting.push_back(k.resting);
        if (some_rolling) rolling.push_back(k.rolling);
    }
}

void PairImpulses::take_over(const PairImpulses& before, const Pairs& list, std::span<const std::uint32_t> slot,
                             Sleep* sleep)
{
    const std::size_t m = pairs.size();
    normal.assign(m, 0);
    tangential.assign(m, Vec3f::Zero());
    resting.assign(before.resting.empty() ? 0 : m, Vec3f::Zero());
    rolling.assign(before.rolling.empty() ? 0 : m, Vec3f::Zero());
    for_each_chunk(before.pairs.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t k = first; k < last; ++k) {
            const bool pressed = before.normal[k] > 0;
            if (!pressed && (resting.empty() || before.resting[k].isZero(0))) continue;
            const auto [i, j] = before.pairs[k];
            const auto here = list.of(i);
            const std::size_t at = count_below(here, j);
            if (at == here.size() || here[at] != j) {
                if (pressed && sleep) sleep->wake(i), sleep->wake(j);
                continue;
            }
            const std::uint32_t to = slot[list.begin[i] + at];
            normal[to] = before.normal[k];
            tangential[to] = before.tangential[k];
            if (!resting.empty()) resting[to] = before.resting[k];
            if (!rolling.empty()) rolling[to] = before.rolling[k];
        }
    });
}

bool PairImpulses::set_unlisted(std::size_t listed, std::span<const ContactPair> found)
{
    const std::vector<ContactPair> before(pairs.begin() + static_cast<std::ptrdiff_t>(listed), pairs.end());
    std::vector<ContactPair> pressing, merged;
    for (std::size_t k = 0; k < before.size(); ++k)
        if (normal[listed + k] > 0) pressing.push_back(before[k]);
    std::set_union(found.begin(), found.end(), pressing.begin(), pressing.end(), std::back_inserter(merged));
    if (merged == before) return false;
    const auto follow = [&](auto& values, const auto& none) {
        const std::vector old(values.begin() + static_cast<std::ptrdiff_t>(listed), values.end());
        values.resize(listed);
        auto known = before.begin();
        for (const ContactPair& pair : merged) {
            known = std::lower_bound(known, before.end(), pair);
            values.push_back(
                known != before.end() && *known == pair ? old[static_cast<std::size_t>(known - before.begin())] : none);
        }
    };
    follow(normal, 0.0f);
    follow(tangential, Vec3f(Vec3f::Zero()));
    if (!resting.empty()) follow(resting, Vec3f(Vec3f::Zero()));
    if (!rolling.empty()) follow(rolling, Vec3f(Vec3f::Zero()));
    pairs.resize(listed);
    pairs.insert(pairs.end(), merged.begin(), merged.end());
    return true;
}

}  // namespace rapid
