#include "runtime/shapes/level_set/baked_grid.h"

#include <array>

namespace rapid {

// Visits blocks in cubic shells around that of P, until no farther block can be nearer.
std::optional<Vec3d> BakedSampler::nearest_inside(const Vec3d& P) const
{
    const std::array<std::int64_t, 3> blocks{blocks_x_, blocks_y_, blocks_z_};
    std::array<std::int64_t, 3> center;
    for (int k = 0; k < 3; ++k)
        center[k] = std::clamp(static_cast<std::int64_t>(std::floor((P[k] - origin_[k]) / block_width_)),
                               std::int64_t(0), blocks[k] - 1);
    std::optional<Vec3d> nearest;
    double least = std::numeric_limits<double>::infinity();  // m, to the surface
    const auto visit = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
        const std::int32_t code = index_[(x * blocks_y_ + y) * blocks_z_ + z];
        if (code < 0) return;
        const Vec3d low = origin_ + block_width_ * Vec3d(x, y, z);
        const Vec3d beyond = (low - P).cwiseMax(P - low - Vec3d::Constant(block_width_)).cwiseMax(0.0);
        if (!(beyond.norm() < least)) return;
        const float* values = values_ + std::size_t(code) * BakedGrid::block_values;
        for (int i = 0; i < BakedGrid::block; ++i)
            for (int j = 0; j < BakedGrid::block; ++j)
                for (int k = 0; k < BakedGrid::block; ++k) {
                    const double phi = values[i * slab + j * row + k];
                    if (!(phi < 0 && -phi <= voxel_)) continue;
                    const Vec3d X = low + voxel_ * Vec3d(i, j, k);
                    const double length = (X - P).norm() - phi;
                    if (!(length < least) || X == P) continue;
                    least = length;
                    nearest = X;
                }
    };
    const std::int64_t farthest = std::max({blocks[0], blocks[1], blocks[2]});
    for (std::int64_t shell = 0; shell < farthest && double(shell - 1) * block_width_ < least; ++shell) {
        const auto from = [&](int axis) { return std::max(center[axis] - shell, std::int64_t(0)); };
        const auto to = [&](int axis) { return std::min(center[axis] + shell, blocks[axis] - 1); };
        for (std::int64_t x = from(0); x <= to(0); ++x)
            for (std::int64_t y = from(1); y <= to(1); ++y) {
                const bool is_side = std::abs(x - center[0]) == shell || std::abs(y - center[1]) == shell;
                for (std::int64_t z = from(2); z <= to(2); ++z)
                    if (is_side || std::abs(z - center[2]) == shell) visit(x, y, z);
            }
    }
    return nearest;
}

}  // namespace rapid
