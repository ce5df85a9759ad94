#include "runtime/solver/constraints/neighbour_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "runtime/base/parallel.h"
#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/impact.h"

namespace rapid {
namespace {

// A point's slack is the distance that it moves in slack_substeps substeps, within these bounds relative to its radius.
// More slack means more pairs to check, but fewer searches.
constexpr double min_slack = 0.25, max_slack = 0.5, slack_substeps = 3;

// The largest fraction of strays: their pairs take longer to find, one by one, and are solved on one thread.
constexpr double max_strays = 0.02;

// Memory per pair: the search, the blocks, two sets of impulses, and full packs.
constexpr double bytes_per_pair = 160;

}  // namespace

void NeighbourList::build(const Substep& step, std::span<const float> radius, const RadiusGrids& grids)
{
    store_positions(step, radius);
    cut_blocks(radius);
    move_frames([&](std::uint32_t i) -> Vec3d { return step.dt * step.v[i]; });
    choose_slack(step, radius);
    is_stray_.assign(step.size(), 0);
    strays_.clear();
    const double largest = grids.grids.empty() ? 0 : grids.grids.front().radius;
    search_.find(at_, {reach_.data(), 1}, grids, pairs_,
                 {fmt::format("radius = {:g} m", largest), "give a smaller radius", bytes_per_pair});
}

bool NeighbourList::is_of(std::size_t points) const
{
    const std::size_t blocks = frames_.size();
    return at_.size() == points && slack_.size() == points && are_below(points_, points) &&
           are_offsets(pairs_.begin, points, pairs_.other.size()) && are_offsets(begin_, blocks, points_.size()) &&
           are_below(neighbouring_, blocks);
}

void NeighbourList::store_positions(const Substep& step, std::span<const float> radius)
{
    float largest = 0, least = std::numeric_limits<float>::infinity();
    for (const float r : radius) {
        largest = std::max(largest, r);
        if (r > 0) least = std::min(least, r);
    }
    const std::size_t n = step.size();
    const double widest = 2.001 * (1 + max_slack) * largest;
    // A block of some hundred pairs if all radii are equal.
    edge_ = std::max(widest + largest, 8.0 * least);
    far_ = edge_ - widest;
    at_.resize(n);
    coordinates_.resize(n);
    for_each_chunk(n, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            at_[i] = step.points[i].P;
            for (int k = 0; k < 3; ++k)
                coordinates_[i][k] = static_cast<std::int32_t>(
                    std::clamp(std::floor(at_[i][k] / edge_), double(INT32_MIN / 2), double(INT32_MAX / 2)));
        }
    });
}

// Assigns points to blocks, and finds neighbouring blocks.
void NeighbourList::cut_blocks(std::span<const float> radius)
{
    const auto key = [](std::int64_t i, std::int64_t j, std::int64_t k) {
        const auto folded = [](std::int64_t c) { return static_cast<std::uint32_t>(c) % across; };
        return (folded(k) * across + folded(j)) * across + folded(i);
    };
    std::vector<std::uint32_t> known(across * across * across, none);
    std::vector<std::array<std::int32_t, 3>> blocks;
    block_of_.resize(coordinates_.size());
    begin_.assign(1, 0);
    for (std::size_t i = 0; i < coordinates_.size(); ++i) {
        block_of_[i] = none;
        if (!(radius[i] > 0)) continue;
        std::uint32_t& b = known[key(coordinates_[i][0], coordinates_[i][1], coordinates_[i][2])];
        if (b == none) {
            b = static_cast<std::uint32_t>(blocks.size());
            blocks.push_back(coordinates_[i]);
            begin_.push_back(0);
        }
        block_of_[i] = b;
        ++begin_[b + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    points_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < block_of_.size(); ++i)
        if (block_of_[i] != none) points_[next[block_of_[i]]++] = static_cast<std::uint32_t>(i);

    frames_.resize(blocks.size());
    neighbouring_.clear();
    for (std::uint32_t b = 0; b < blocks.size(); ++b)
        for (int k = -1; k <= 1; ++k)
            for (int j = -1; j <= 1; ++j)
                for (int i = -1; i <= 1; ++i) {
                    const std::uint32_t a = known[key(blocks[b][0] + i, blocks[b][1] + j, blocks[b][2] + k)];
                    if (a != none && a < b) neighbouring_.push_back({a, b});
                }
}

// displacement(i): of a point, m.
template <class F>
void NeighbourList::move_frames(const F& displacement)
{
    for_each_chunk(
        frames_.size(),
        [&](std::size_t first, std::size_t last) {
            for (std::size_t b = first; b < last; ++b) {
                frames_[b] = {};
                for (const std::uint32_t i : points_of(b)) frames_[b].shift += displacement(i);
                frames_[b].shift /= static_cast<double>(points_of(b).size());
            }
        },
        blocks_per_task);
    for (const auto& [a, b] : neighbouring_) {
        const double apart = 0.5 * (frames_[a].shift - frames_[b].shift).norm();
        frames_[a].separation = std::max(frames_[a].separation, apart);
        frames_[b].separation = std::max(frames_[b].separation, apart);
    }
}

void NeighbourList::choose_slack(const Substep& step, std::span<const float> radius)
{
    const std::size_t n = step.size();
    // Returns the distance, m, by which a point leaves its frame, or its neighbours' frames leave it, in a substep.
    const auto leaves = [&](std::size_t i) {
        const Frame& frame = frames_[block_of_[i]];
        return (step.dt * step.v[i] - frame.shift).norm() + frame.separation;
    };
    reach_.assign(n, 0);
    slack_.resize(n);
    for_each_chunk(n, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!(radius[i] > 0)) continue;
            slack_[i] =
                std::clamp(static_cast<float>(slack_substeps * leaves(i)), static_cast<float>(min_slack) * radius[i],
                           static_cast<float>(max_slack) * radius[i]);
            reach_[i] = radius[i] + slack_[i];
            slack_[i] = reach_[i] - radius[i];
        }
    });
}

bool NeighbourList::expired(const Substep& step)
{
    move_frames([&](std::uint32_t i) -> Vec3d { return step.points[i].P - at_[i]; });
    if (!blocks_are_separate()) return true;
    find_strays(step);
    return static_cast<double>(strays_.size()) > max_strays * static_cast<double>(step.size());
}

bool NeighbourList::blocks_are_separate() const
{
    Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Frame& frame : frames_) {
        low = low.cwiseMin(frame.shift);
        high = high.cwiseMax(frame.shift);
    }
    return frames_.empty() || (high - low).norm() <= far_;
}

void NeighbourList::find_strays(const Substep& step)
{
    is_stray_.assign(step.size(), 0);
    for_each_chunk(
        frames_.size(),
        [&](std::size_t first, std::size_t last) {
            for (std::size_t b = first; b < last; ++b)
                for (const std::uint32_t i : points_of(b)) {
                    const double left = slack_[i] - frames_[b].separation;
                    const Vec3d x = step.points[i].P - at_[i] - frames_[b].shift;
                    is_stray_[i] = !(left >= 0 && x.squaredNorm() <= left * left);
                }
        },
        blocks_per_task);
    strays_.clear();
    for (std::uint32_t i = 0; i < is_stray_.size(); ++i)
        if (is_stray_[i]) strays_.push_back(i);
}

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
