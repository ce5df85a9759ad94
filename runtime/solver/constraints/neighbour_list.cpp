#include "runtime/solver/constraints/neighbour_list.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "runtime/parallel.h"

namespace rapid {
namespace {

// How far points may move before pairs are looked for again, as a part of their radius: at least, at most, and between
// these as far as they go in so many sub-steps. More pairs to look at, or more searches.
constexpr double least_slack = 0.25, most_slack = 1, slack_substeps = 3;

// Blocks whose points are handed to a thread together.
constexpr std::size_t blocks_a_task = 16;

}  // namespace

void SearchedPlaces::set(const Substep& now, std::span<const float> radius, float largest, float least)
{
    const std::size_t n = now.size();
    const double widest = 2.001 * (1 + most_slack) * largest;
    // Of some hundred pairs where all radii are alike.
    edge_ = std::max(widest + largest, 8.0 * least);
    far_ = edge_ - widest;
    at_.resize(n);
    block_.resize(n);
    for_each_chunk(n, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            at_[i] = now.at[i].P;
            for (int k = 0; k < 3; ++k)
                block_[i][k] = static_cast<std::int32_t>(
                    std::clamp(std::floor(at_[i][k] / edge_), double(INT32_MIN / 2), double(INT32_MAX / 2)));
        }
    });
    cut_blocks(radius);

    for_each_chunk(
        frames_.size(),
        [&](std::size_t first, std::size_t last) {
            for (std::size_t b = first; b < last; ++b) {
                frames_[b] = {};
                for (std::uint32_t p = begin_[b]; p < begin_[b + 1]; ++p) frames_[b].way += now.v[points_[p]];
                frames_[b].way *= now.dt / (begin_[b + 1] - begin_[b]);
            }
        },
        blocks_a_task);
    for (const auto& [a, b] : nearby_) {
        const double apart = 0.5 * (frames_[a].way - frames_[b].way).norm();
        frames_[a].excess = std::max(frames_[a].excess, apart);
        frames_[b].excess = std::max(frames_[b].excess, apart);
    }
    // m, by which a point leaves its frame in a sub-step, or its neighbours' frames leave it.
    const auto leaves = [&](std::size_t i) {
        const Frame& frame = frames_[home_[i]];
        return (now.dt * now.v[i] - frame.way).norm() + frame.excess;
    };
    // Where searches do not last, because of one point maybe, more slack only finds more pairs: it is tried again at
    // every eighth.
    in_vain_ = lasted_ > 1 ? 0 : in_vain_ + 1;
    const double substeps = in_vain_ % 8 == 0 ? slack_substeps : 0;
    lasted_ = 0;
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

// Which points are in each block, and which blocks are neighbours.
void SearchedPlaces::cut_blocks(std::span<const float> radius)
{
    const auto key = [](std::int64_t i, std::int64_t j, std::int64_t k) {
        const auto folded = [](std::int64_t c) { return static_cast<std::uint32_t>(c) % across; };
        return (folded(k) * across + folded(j)) * across + folded(i);
    };
    std::vector<std::uint32_t> known(across * across * across, none);
    std::vector<std::array<std::int32_t, 3>> blocks;
    home_.resize(block_.size());
    begin_.assign(1, 0);
    for (std::size_t i = 0; i < block_.size(); ++i) {
        home_[i] = none;
        if (!(radius[i] > 0)) continue;
        std::uint32_t& b = known[key(block_[i][0], block_[i][1], block_[i][2])];
        if (b == none) {
            b = static_cast<std::uint32_t>(blocks.size());
            blocks.push_back(block_[i]);
            begin_.push_back(0);
        }
        home_[i] = b;
        ++begin_[b + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    points_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < home_.size(); ++i)
        if (home_[i] != none) points_[next[home_[i]]++] = static_cast<std::uint32_t>(i);

    frames_.resize(blocks.size());
    nearby_.clear();
    for (std::uint32_t b = 0; b < blocks.size(); ++b)
        for (int k = -1; k <= 1; ++k)
            for (int j = -1; j <= 1; ++j)
                for (int i = -1; i <= 1; ++i) {
                    const std::uint32_t a = known[key(blocks[b][0] + i, blocks[b][1] + j, blocks[b][2] + k)];
                    if (a != none && a < b) nearby_.push_back({a, b});
                }
}

bool SearchedPlaces::outrun(const Substep& now)
{
    ++lasted_;
    for_each_chunk(
        frames_.size(),
        [&](std::size_t first, std::size_t last) {
            for (std::size_t b = first; b < last; ++b) {
                const std::span<const std::uint32_t> here =
                    std::span(points_).subspan(begin_[b], begin_[b + 1] - begin_[b]);
                Vec3d way = Vec3d::Zero();
                for (const std::uint32_t i : here) way += now.at[i].P - at_[i];
                way /= static_cast<double>(here.size());
                double excess = -std::numeric_limits<double>::infinity();
                for (const std::uint32_t i : here)
                    excess = std::max(excess, (now.at[i].P - at_[i] - way).norm() - slack_[i]);
                frames_[b] = {way, excess};
            }
        },
        blocks_a_task);
    Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Frame& frame : frames_) {
        if (!(frame.excess <= 0)) return true;
        low = low.cwiseMin(frame.way);
        high = high.cwiseMax(frame.way);
    }
    if (!frames_.empty() && (high - low).norm() > far_) return true;
    return std::any_of(nearby_.begin(), nearby_.end(), [&](const auto& pair) {
        const Frame &a = frames_[pair[0]], &b = frames_[pair[1]];
        return a.excess + b.excess + (a.way - b.way).norm() > 0;
    });
}

}  // namespace rapid
