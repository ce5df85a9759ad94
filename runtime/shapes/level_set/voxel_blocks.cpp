#include "runtime/shapes/level_set/voxel_blocks.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

namespace rapid {

VoxelFrame frame_around(const Box3d& bounds, double voxel)
{
    // Beyond this, mesh corners in single precision would have an error of more than 1/2048 of a voxel.
    constexpr double far = 16384;  // voxels
    VoxelFrame frame{voxel};
    const double farthest = bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).maxCoeff() / voxel;
    if (farthest > far) frame.origin = (bounds.center() / voxel).array().round().matrix() * voxel;
    return frame;
}

namespace {

// The indices of the blocks within their bounding box. Positions without a block have the side of the surface instead.
class Around {
public:
    explicit Around(const VoxelBlocks& blocks)
    {
        for (const VoxelBlocks::BlockCoord& coord : blocks.coords) box_.extend(coord);
        if (box_.isEmpty()) return;
        size_ = box_.max() - box_.min() + VoxelBlocks::BlockCoord::Ones();
        index_.assign(std::size_t(size_.x()) * size_.y() * size_.z(), BakedGrid::outside);
        for (std::size_t b = 0; b < blocks.size(); ++b) index_[at(blocks.coords[b])] = static_cast<std::int32_t>(b);
        tbb::parallel_for(std::size_t{0}, index_.size() / size_.z(), [&](std::size_t row) {
            std::int32_t side = BakedGrid::outside;
            for (std::size_t i = row * size_.z(); i < (row + 1) * size_.z(); ++i)
                if (index_[i] < 0)
                    index_[i] = side;
                else
                    side = blocks.of(index_[i]).back() < 0 ? BakedGrid::inside : BakedGrid::outside;
        });
    }

    const Eigen::AlignedBox3i& box() const { return box_; }
    // Returns a block's index, or BakedGrid::outside or inside.
    std::int32_t operator[](const VoxelBlocks::BlockCoord& coord) const
    {
        return box_.contains(coord) ? index_[at(coord)] : BakedGrid::outside;
    }

private:
    std::size_t at(const VoxelBlocks::BlockCoord& coord) const
    {
        const VoxelBlocks::BlockCoord from = coord - box_.min();
        return (std::size_t(from.x()) * size_.y() + from.y()) * size_.z() + from.z();
    }

    Eigen::AlignedBox3i box_;
    VoxelBlocks::BlockCoord size_;
    std::vector<std::int32_t> index_;
};

}  // namespace

std::uint64_t VoxelBlocks::voxels_in_band() const
{
    std::uint64_t sum = 0;
    for (const Flags& flags : in_band)
        for (const std::uint64_t word : flags) sum += std::popcount(word);
    return sum;
}

void VoxelBlocks::resize(std::size_t blocks)
{
    coords.resize(blocks);
    values.resize(blocks * voxels);
    in_band.resize(blocks);
}

void VoxelBlocks::move_block(std::size_t from, std::size_t to)
{
    coords[to] = coords[from];
    in_band[to] = in_band[from];
    std::ranges::copy(of(from), of(to).begin());
}

BakedGrid bake(const VoxelBlocks& blocks)
{
    const Around around(blocks);
    const float beyond = blocks.background();
    const auto at = [&](const VoxelBlocks::BlockCoord& coord) {
        const std::int32_t b = around[coord];
        return b >= 0 ? BlockValues{blocks.of(b).data(), 0}
                      : BlockValues{nullptr, b == BakedGrid::inside ? -beyond : beyond};
    };
    return bake(BlockTable{around.box(), blocks.frame.voxel, beyond,
                           [&](const Vec3d& P) { return blocks.frame.to_world(P); }, [&] { return std::ref(at); }});
}

namespace {

using BlockCoord = BlockTable::BlockCoord;

constexpr int block = BakedGrid::block, edge = BakedGrid::edge;

// Returns the block at `coord` and its seven upper neighbours: bit 2 of the index is +x, bit 1 +y, bit 0 +z.
std::array<BlockValues, 8> neighbourhood(const BlockTable::Reader& at, const BlockCoord& coord)
{
    std::array<BlockValues, 8> blocks;
    for (int n = 0; n < 8; ++n) blocks[n] = at(coord + BlockCoord(n >> 2, n >> 1 & 1, n & 1));
    return blocks;
}

void copy_block(const std::array<BlockValues, 8>& blocks, float* into)
{
    for (int i = 0; i < edge; ++i)
        for (int j = 0; j < edge; ++j)
            for (int k = 0; k < edge; ++k)
                *into++ = blocks[(i >> 3) << 2 | (j >> 3) << 1 | k >> 3].at(i & 7, j & 7, k & 7);
}

// Statistics of the field over the cells of some blocks.
struct Survey {
    Eigen::AlignedBox3i crossed;  // the cells where the sign changes, in voxels
    std::uint64_t crossings = 0;
    float steepest = 0;  // squared slope, m² per voxel²

    void join(const Survey& other)
    {
        crossed.extend(other.crossed);
        crossings += other.crossings;
        steepest = std::max(steepest, other.steepest);
    }
};

// Surveys a block. Within a trilinear cell each component of the gradient is affine along each axis, so its squared
// length is convex along each axis. The maximum is therefore at a corner of the cell, where the components are the
// differences along the edges that meet there.
Survey survey_block(const float* values, const Eigen::Vector3i& first)
{
    Survey survey;
    constexpr int slab = edge * edge;
    for (int i = 0; i < block; ++i)
        for (int j = 0; j < block; ++j)
            for (int k = 0; k < block; ++k) {
                const float* c = values + i * slab + j * edge + k;
                float dx[2][2], dy[2][2], dz[2][2];
                int negative = 0;
                for (int a = 0; a < 2; ++a)
                    for (int b = 0; b < 2; ++b) {
                        dx[a][b] = c[slab + a * edge + b] - c[a * edge + b];
                        dy[a][b] = c[a * slab + edge + b] - c[a * slab + b];
                        dz[a][b] = c[a * slab + b * edge + 1] - c[a * slab + b * edge];
                        negative += (c[a * slab + b * edge] < 0) + (c[a * slab + b * edge + 1] < 0);
                    }
                for (int x = 0; x < 2; ++x)
                    for (int y = 0; y < 2; ++y)
                        for (int z = 0; z < 2; ++z)
                            survey.steepest = std::max(survey.steepest,
                                                       dx[y][z] * dx[y][z] + dy[x][z] * dy[x][z] + dz[x][y] * dz[x][y]);
                if (negative != 0 && negative != 8) {
                    const Eigen::Vector3i cell = first + Eigen::Vector3i(i, j, k);
                    survey.crossed.extend(cell);
                    survey.crossed.extend(cell + Eigen::Vector3i::Ones());
                    ++survey.crossings;
                }
            }
    return survey;
}

// Writes into each empty block of the index the number of blocks between it and the nearest block with values: the
// chessboard distance minus one, by the two passes of Rosenfeld and Pfaltz (1966).
void count_blocks_between(BakedGrid& baked)
{
    const Eigen::Vector3i& n = baked.blocks;
    const auto pass = [&](int step) {
        const auto begin = [&](int axis) { return step > 0 ? 0 : n[axis] - 1; };
        const auto within = [&](int i, int axis) { return i >= 0 && i < n[axis]; };
        const auto at = [&](int x, int y, int z) -> std::int32_t& {
            return baked.index[(std::size_t(x) * n.y() + y) * n.z() + z];
        };
        for (int x = begin(0); within(x, 0); x += step)
            for (int y = begin(1); within(y, 1); y += step)
                for (int z = begin(2); within(z, 2); z += step) {
                    std::int32_t& code = at(x, y, z);
                    if (code >= 0) continue;
                    int nearest = step > 0 ? n.maxCoeff() : BakedGrid::between(code) + 1;
                    for (int neighbour = 0; neighbour < 13; ++neighbour) {  // already visited
                        const int i = x + step * (neighbour / 9 - 1), j = y + step * (neighbour / 3 % 3 - 1),
                                  k = z + step * (neighbour % 3 - 1);
                        if (!within(i, 0) || !within(j, 1) || !within(k, 2)) continue;
                        const std::int32_t other = at(i, j, k);
                        nearest = std::min(nearest, other >= 0 ? 1 : BakedGrid::between(other) + 2);
                    }
                    code = (BakedGrid::is_outside(code) ? BakedGrid::outside : BakedGrid::inside) - 2 * (nearest - 1);
                }
    };
    pass(1);
    pass(-1);
}

class Baker {
public:
    explicit Baker(const BlockTable& blocks) : blocks_(blocks)
    {
        baked_.voxel = blocks.voxel;
        baked_.background = blocks.background;
    }

    BakedGrid bake()
    {
        if (blocks_.with_values.isEmpty()) return baked_;
        cover();
        find_blocks_with_values();
        number_varying_blocks();
        count_blocks_between(baked_);
        const Survey survey = copy_values();

        baked_.slope = std::max(1.0, std::sqrt(double(survey.steepest)) / baked_.voxel);
        baked_.crossings = survey.crossings;
        if (survey.crossings > 0)
            baked_.surface = Box3d(baked_.origin + baked_.voxel * survey.crossed.min().cast<double>(),
                                   baked_.origin + baked_.voxel * survey.crossed.max().cast<double>());
        return std::move(baked_);
    }

private:
    // Extends the box by a block on the lower sides. These blocks store the cells between the lowest values and the
    // constant beyond.
    void cover()
    {
        low_ = blocks_.with_values.min() - BlockCoord::Ones();
        baked_.blocks = blocks_.with_values.max() - low_ + BlockCoord::Ones();
        baked_.origin = blocks_.to_world((block * low_).cast<double>());
        in_slab_ = std::size_t(baked_.blocks.y()) * baked_.blocks.z();
        baked_.index.resize(in_slab_ * baked_.blocks.x());
        has_values_.resize(baked_.index.size());
        varying_.assign(baked_.blocks.x() + 1, 0);
    }

    BlockCoord position(std::size_t b) const
    {
        const std::size_t in = b % in_slab_, n_z = std::size_t(baked_.blocks.z());
        return {static_cast<int>(b / in_slab_), static_cast<int>(in / n_z), static_cast<int>(in % n_z)};
    }

    // Calls f(block, reader) for all blocks, in parallel over slabs of x.
    template <class F>
    void for_each_block(const F& f) const
    {
        tbb::parallel_for(0, baked_.blocks.x(), [&](int x) {
            const BlockTable::Reader reader = blocks_.reader();
            for (std::size_t b = x * in_slab_; b < (x + 1) * in_slab_; ++b) f(b, reader);
        });
    }

    void find_blocks_with_values()
    {
        for_each_block([&](std::size_t b, const BlockTable::Reader& at) {
            const BlockValues here = at(low_ + position(b));
            has_values_[b] = here.values != nullptr;
            baked_.index[b] = here.at(0, 0, 0) < 0 ? BakedGrid::inside : BakedGrid::outside;
        });
    }

    bool has_values_above(std::size_t b) const
    {
        const BlockCoord at = position(b), &n = baked_.blocks;
        for (int k = 1; k < 8; ++k) {
            const int x = at.x() + (k >> 2), y = at.y() + (k >> 1 & 1), z = at.z() + (k & 1);
            if (x < n.x() && y < n.y() && z < n.z() && has_values_[(std::size_t(x) * n.y() + y) * n.z() + z])
                return true;
        }
        return false;
    }

    // Numbers the blocks with values, and their lower neighbours if the cells between vary. Each slab of x is numbered
    // separately and offset by the preceding slabs later, so that the numbers depend only on the blocks.
    void number_varying_blocks()
    {
        for_each_block([&](std::size_t b, const BlockTable::Reader& at) {
            bool varies = has_values_[b];
            if (!varies && has_values_above(b)) {
                std::array<float, BakedGrid::block_values> values;
                copy_block(neighbourhood(at, low_ + position(b)), values.data());
                varies = std::any_of(values.begin(), values.end(), [&](float v) { return v != values[0]; });
            }
            if (varies) baked_.index[b] = varying_[b / in_slab_ + 1]++;
        });
        for (int x = 0; x < baked_.blocks.x(); ++x) varying_[x + 1] += varying_[x];
    }

    Survey copy_values()
    {
        baked_.values.resize(std::size_t(varying_.back()) * BakedGrid::block_values);
        return tbb::parallel_deterministic_reduce(
            tbb::blocked_range<int>(0, baked_.blocks.x()), Survey(),
            [&](const tbb::blocked_range<int>& slabs, Survey sum) {
                const BlockTable::Reader at = blocks_.reader();
                for (std::size_t b = slabs.begin() * in_slab_; b < slabs.end() * in_slab_; ++b) {
                    if (baked_.index[b] < 0) continue;
                    baked_.index[b] += varying_[b / in_slab_];
                    float* values = baked_.values.data() + std::size_t(baked_.index[b]) * BakedGrid::block_values;
                    copy_block(neighbourhood(at, low_ + position(b)), values);
                    sum.join(survey_block(values, block * position(b)));
                }
                return sum;
            },
            [](Survey a, const Survey& b) {
                a.join(b);
                return a;
            });
    }

    const BlockTable& blocks_;
    BakedGrid baked_;
    BlockCoord low_ = BlockCoord::Zero();   // lowest block
    std::size_t in_slab_ = 0;               // blocks per slab of x
    std::vector<std::uint8_t> has_values_;  // per block
    std::vector<std::int32_t> varying_;     // blocks with values in the slabs before x, shape [blocks x + 1]
};

}  // namespace

BakedGrid bake(const BlockTable& blocks) { return Baker(blocks).bake(); }

}  // namespace rapid
