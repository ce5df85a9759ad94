#include "runtime/shapes/level_set/voxel_blocks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <functional>

#include "runtime/shapes/level_set/bake.h"

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

}  // namespace rapid
