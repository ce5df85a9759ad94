#include "runtime/solver/constraints/stray_pairs.h"

#include <algorithm>
#include <limits>

#include "runtime/base/parallel.h"
#include "runtime/solver/constraints/impact.h"

namespace rapid {
namespace {

// Bounding box of the points of a block that are not strays.
struct Box {
    Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    float largest = 0;  // m, radius

    double distance2(const Vec3d& P) const
    {
        return (low - P).cwiseMax(P - high).cwiseMax(Vec3d::Zero()).squaredNorm();
    }
};

ContactPair in_order(std::uint32_t i, std::uint32_t j) { return {std::min(i, j), std::max(i, j)}; }

double squared(double x) { return x * x; }

}  // namespace

const std::vector<ContactPair>& StrayPairs::find(const Substep& step, std::span<const float> radius,
                                                 const NeighbourList& list)
{
    pairs_.clear();
    if (list.strays().empty()) return pairs_;
    sort_strays(step, radius, list);
    constexpr std::size_t each = NeighbourList::blocks_per_task;
    found_.resize((list.blocks() + each - 1) / each);
    for_each_chunk(
        list.blocks(),
        [&](std::size_t first, std::size_t last) {
            std::vector<ContactPair>& found = found_[first / each];
            found.clear();
            for (std::size_t b = first; b < last; ++b) find_in_block(b, step, radius, list, found);
        },
        each);
    find_among_strays(radius);
    for (const std::vector<ContactPair>& found : found_) pairs_.insert(pairs_.end(), found.begin(), found.end());
    std::erase_if(pairs_, [&](const ContactPair& pair) {
        const auto listed = list.pairs().of(pair[0]);
        return std::binary_search(listed.begin(), listed.end(), pair[1]);
    });
    std::sort(pairs_.begin(), pairs_.end());
    return pairs_;
}

void StrayPairs::sort_strays(const Substep& step, std::span<const float> radius, const NeighbourList& list)
{
    strays_.clear();
    largest_ = 0;
    for (const std::uint32_t i : list.strays()) {
        strays_.push_back({step.points[i].P, i});
        largest_ = std::max(largest_, double(radius[i]));
    }
    std::sort(strays_.begin(), strays_.end(), [](const Stray& a, const Stray& b) { return a.P.x() < b.P.x(); });
}

void StrayPairs::find_in_block(std::size_t block, const Substep& step, std::span<const float> radius,
                               const NeighbourList& list, std::vector<ContactPair>& found) const
{
    Box box;
    for (const std::uint32_t j : list.points_of(block)) {
        if (list.is_stray(j)) continue;
        box.low = box.low.cwiseMin(step.points[j].P);
        box.high = box.high.cwiseMax(step.points[j].P);
        box.largest = std::max(box.largest, radius[j]);
    }
    const double farthest = near_contact * (largest_ + box.largest);
    auto stray = std::partition_point(strays_.begin(), strays_.end(),
                                      [&](const Stray& s) { return s.P.x() < box.low.x() - farthest; });
    for (; stray != strays_.end() && stray->P.x() <= box.high.x() + farthest; ++stray) {
        const double r = radius[stray->i];
        if (box.distance2(stray->P) > squared(near_contact * (r + box.largest))) continue;
        for (const std::uint32_t j : list.points_of(block))
            if ((step.points[j].P - stray->P).squaredNorm() <= squared(near_contact * (r + radius[j])) &&
                !list.is_stray(j))
                found.push_back(in_order(stray->i, j));
    }
}

void StrayPairs::find_among_strays(std::span<const float> radius)
{
    for (auto a = strays_.begin(); a != strays_.end(); ++a) {
        const double r = radius[a->i], farthest = near_contact * (r + largest_);
        for (auto b = a + 1; b != strays_.end() && b->P.x() - a->P.x() <= farthest; ++b)
            if ((a->P - b->P).squaredNorm() <= squared(near_contact * (r + radius[b->i])))
                pairs_.push_back(in_order(a->i, b->i));
    }
}

}  // namespace rapid
