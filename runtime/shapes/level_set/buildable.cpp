#include "runtime/shapes/level_set/buildable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/shapes/level_set/baked_grid.h"

namespace rapid {

void require_legal(const LevelSetOptions& options)
{
    if (!(options.voxel > 0) || !std::isfinite(options.voxel))
        throw Error(fmt::format("voxel = {:g} m is out of range; it must be above 0", options.voxel));
    // The gradient at the surface needs the values of the adjacent cells on both sides.
    if (!(options.half_width >= 2) || !std::isfinite(options.half_width))
        throw Error(fmt::format("half_width = {:g} voxels is out of range; it must be at least 2", options.half_width));
}

void require_buildable(std::string_view what, double area, const Box3d& bounds, const LevelSetOptions& options)
{
    constexpr double most = 2147483648.0;  // 2^31
    // Covers the blocks during the build and the baked copy: 30 to 60 bytes per voxel of a smooth surface at half
    // widths of 3 to 10, where a third to two thirds of a leaf is in the band.
    constexpr double bytes_per_voxel = 64;

    // Far from the surface leaves are full.
    constexpr double bytes_per_voxel_around = 16;

    // Covers the index and, while it is built, the index of the measured blocks and the flags of blocks with values.
    constexpr double bytes_per_block = 2 * sizeof(std::int32_t) + 1;

    // For a convex body the volume of the outer band is area h + M h² + 4/3 pi h³ (Steiner's formula). M is at most
    // that of the bounds, pi times the sum of their edges.
    const double h = options.half_width;  // voxels
    const Vec3d size = bounds.sizes() / options.voxel, across = size + Vec3d::Constant(2 * h);
    const double in_band = area / (options.voxel * options.voxel) * 2 * h;
    const double around = M_PI * size.sum() * h * h + 4.0 / 3 * M_PI * h * h * h;
    const double near = std::min(in_band, across.prod()), voxels = std::min(near + around, across.prod());
    const double indexed = (across / BakedGrid::block + Vec3d::Constant(2)).prod();
    const double bytes = near * bytes_per_voxel + (voxels - near) * bytes_per_voxel_around + indexed * bytes_per_block;

    // The larger voxel at which the band (which shrinks with its square) and the index (with its cube) fit.
    const auto larger = [&](double band_excess, double index_excess) {
        return 1.02 * options.voxel * std::max({1.0, std::sqrt(band_excess), std::cbrt(index_excess)});
    };
    if (voxels > most || indexed > most)
        throw Error(
            fmt::format("{} with voxel = {:g} m would make about {:.3g} voxels and an index of {:.3g} blocks, but at "
                        "most 2147483648 of each are possible; use a voxel of at least {:.3g} m",
                        what, options.voxel, voxels, indexed, larger(voxels / most, indexed / most)));
    if (fits_in_memory(bytes)) return;
    const double memory = static_cast<double>(memory_budget());
    throw memory_exceeded(fmt::format("{} with voxel = {:g} m", what, options.voxel), bytes,
                          fmt::format("use a voxel of at least {:.3g} m", larger(bytes / memory, bytes / memory)));
}

}  // namespace rapid
