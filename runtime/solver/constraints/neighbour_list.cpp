#include "runtime/solver/constraints/neighbour_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "runtime/parallel.h"
#include "runtime/points/state_checks.h"

namespace rapid {
namespace {

// How far points may move before the list expires, as a part of their radius: at least, at most, and between these as
// far as they go in so many sub-steps. More pairs to look at, or more searches.
constexpr double least_slack = 0.25, most_slack = 1, slack_substeps = 3;

// Blocks whose points are handed to a thread together.
constexpr std::size_t blocks_a_task = 16;

// What a pair takes: in the search, the blocks, two sets of impulses, and packs that are full.
constexpr double bytes_a_pair = 160;

}  // namespace

void NeighbourList::build(const Substep& step, std::span<const float> radius, const RadiusGrids& grids)
{
    store_positions(step, radius);
    cut_blocks(radius);
    predict_motion(step);
    choose_slack(step, radius);
    const double largest = grids.grids.empty() ? 0 : grids.grids.front().radius;
    search_.find(at_, {reach_.data(), 1}, grids, pairs_,
                 {fmt::format("radius = {:g} m", largest), "give a smaller radius", bytes_a_pair});
}

bool NeighbourList::is_of(std::size_t points) const
{
    const std::size_t blocks = frames_.size();
    return at_.size() == points && slack_.size() == points && are_below(points_, points) &&
           are_offsets(begin_, blocks, points_.size()) && are_below(neighbouring_, blocks);
}

void NeighbourList::store_positions(const Substep& step, std::span<const float> radius)
{
    float largest = 0, least = std::numeric_limits<float>::infinity();
    for (const float r : radius) {
        largest = std::max(largest, r);
        if (r > 0) least = std::min(least, r);
    }
    const std::size_t n = step.size();
    const double widest = 2.001 * (1 + most_slack) * largest;
    // Of some hundred pairs where all radii are alike.
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

// Which points are in each block, and which blocks are neighbours.
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

// What the velocities shift each block by in a sub-step; its excess is how far its neighbours leave it.
void NeighbourList::predict_motion(const Substep& step)
{
    for_each_chunk(
        frames_.size(),
        [&](std::size_t first, std::size_t last) {
            for (std::size_t b = first; b < last; ++b) {
                frames_[b] = {};
                for (std::uint32_t p = begin_[b]; p < begin_[b + 1]; ++p) frames_[b].shift += step.v[points_[p]];
                frames_[b].shift *= step.dt / (begin_[b + 1] - begin_[b]);
            }
        },
        blocks_a_task);
    for (const auto& [a, b] : neighbouring_) {
        const double apart = 0.5 * (frames_[a].shift - frames_[b].shift).norm();
        frames_[a].excess = std::max(frames_[a].excess, apart);
        frames_[b].excess = std::max(frames_[b].excess, apart);
    }
}

void NeighbourList::choose_slack(const Substep& step, std::span<const float> radius)
{
    const std::size_t n = step.size();
    // m, by which a point leaves its frame in a sub-step, or its neighbours' frames leave it.
    const auto leaves = [&](std::size_t i) {
        const Frame& frame = frames_[block_of_[i]];
        return (step.dt * step.v[i] - frame.shift).norm() + frame.excess;
    };
    // Where lists do not last, because of a single point maybe, more slack only finds more pairs: it is tried again at
    // every eighth.
    short_lived_ = age_ > 1 ? 0 : short_lived_ + 1;
    const double substeps = short_lived_ % 8 == 0 ? slack_substeps : 0;
    age_ = 0;
    reach_.assign(n, 0);
    slack_.resize(n);
    for_each_chunk(n, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!(radius[i] > 0)) continue;
            slack_[i] =
                std::clamp(static_cast<float>(substeps * leaves(i)), static_cast<float>(least_slack) * radius[i],
                           static_cast<float>(most_slack) * radius[i]);
            reach_[i] = radius[i] + slack_[i];
            slack_[i] = reach_[i] - radius[i];
        }
    });
}

bool NeighbourList::expired(const Substep& step)
{
    ++age_;
    measure_motion(step);
    Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Frame& frame : frames_) {
        if (!(frame.excess <= 0)) return true;
        low = low.cwiseMin(frame.shift);
        high = high.cwiseMax(frame.shift);
    }
    if (!frames_.empty() && (high - low).norm() > far_) return true;
    return std::any_of(neighbouring_.begin(), neighbouring_.end(), [&](const auto& pair) {
        const Frame &a = frames_[pair[0]], &b = frames_[pair[1]];
        return a.excess + b.excess + (a.shift - b.shift).norm() > 0;
    });
}

void NeighbourList::measure_motion(const Substep& step)
{
    for_each_chunk(
        frames_.size(),
        [&](std::size_t first, std::size_t last) {
            for (std::size_t b = first; b < last; ++b) {
                const std::span<const std::uint32_t> here =
                    std::span(points_).subspan(begin_[b], begin_[b + 1] - begin_[b]);
                Vec3d shift = Vec3d::Zero();
                for (const std::uint32_t i : here) shift += step.points[i].P - at_[i];
                shift /= static_cast<double>(here.size());
                double excess = -std::numeric_limits<double>::infinity();
                for (const std::uint32_t i : here)
                    excess = std::max(excess, (step.points[i].P - at_[i] - shift).norm() - slack_[i]);
                frames_[b] = {shift, excess};
            }
        },
        blocks_a_task);
}

}  // namespace rapid
