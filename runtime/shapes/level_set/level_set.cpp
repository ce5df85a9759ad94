#include "runtime/shapes/level_set/level_set.h"

#include <fmt/format.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <cmath>

#include "runtime/memory_budget.h"
#include "runtime/shapes/level_set/level_set_grid.h"

namespace rapid {

void initialize_openvdb()
{
    static const bool once = (openvdb::initialize(), true);
    static_cast<void>(once);
}

void require_legal(const LevelSetOptions& options)
{
    if (!(options.voxel > 0) || !std::isfinite(options.voxel))
        throw Error(fmt::format("voxel = {:g} m is out of range; it must be above 0", options.voxel));
    // The gradient at the surface needs the values of the cells around it, on both sides.
    if (!(options.half_width >= 2) || !std::isfinite(options.half_width))
        throw Error(fmt::format("half_width = {:g} voxels is out of range; it must be at least 2", options.half_width));
}

void require_buildable(std::string_view what, double area, const Box3d& bounds, const LevelSetOptions& options)
{
    constexpr double most = 2147483648.0;  // 2^31
    // Of the tree while it is built, and of the baked copy: 30 to 60 bytes a voxel of a smooth surface at half widths
    // of 3 to 10, where a third to two thirds of a leaf is in the band.
    constexpr double bytes_a_voxel = 64;

    // Far from the surface leaves are whole.
    constexpr double bytes_a_voxel_around = 16;

    // Of a convex body the band outside is area h + M h² + 4/3 pi h³ (Steiner's formula), and M is at most that of the
    // bounds, pi times the sum of their edges.
    const double h = options.half_width;  // voxels
    const Vec3d size = bounds.sizes() / options.voxel, across = size + Vec3d::Constant(2 * h);
    const double in_band = area / (options.voxel * options.voxel) * 2 * h;
    const double around = M_PI * size.sum() * h * h + 4.0 / 3 * M_PI * h * h * h;
    const double near = std::min(in_band, across.prod()), voxels = std::min(near + around, across.prod());
    const double indexed = (across / BakedGrid::block + Vec3d::Constant(2)).prod();
    const double bytes = near * bytes_a_voxel + (voxels - near) * bytes_a_voxel_around + indexed * sizeof(std::int32_t);

    // The larger voxel for which the band (which shrinks with its square) and the index (with its cube) fit.
    const auto larger = [&](double band_excess, double index_excess) {
        return 1.02 * options.voxel * std::max({1.0, std::sqrt(band_excess), std::cbrt(index_excess)});
    };
    if (voxels > most || indexed > most)
        throw Error(
            fmt::format("{} with voxel = {:g} m would make about {:.3g} voxels and an index of {:.3g} blocks, and "
                        "2147483648 of each can be held; a voxel of at least {:.3g} m stays below that",
                        what, options.voxel, voxels, indexed, larger(voxels / most, indexed / most)));
    if (fits_in_memory(bytes)) return;
    const double memory = static_cast<double>(memory_budget());
    throw beyond_memory(fmt::format("{} with voxel = {:g} m", what, options.voxel), bytes,
                        fmt::format("a voxel of at least {:.3g} m fits", larger(bytes / memory, bytes / memory)));
}

openvdb::math::Transform::Ptr make_transform(double voxel, const Box3d& bounds)
{
    // Beyond this the corners of a mesh, in single precision, would be off by more than 1/2048 of a voxel.
    constexpr double far = 16384;  // voxels
    auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    const double farthest = bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).maxCoeff() / voxel;
    if (farthest > far) {
        const Vec3d whole = (bounds.center() / voxel).array().round().matrix() * voxel;
        transform->postTranslate({whole.x(), whole.y(), whole.z()});
    }
    return transform;
}

GridLevelSet::GridLevelSet(openvdb::FloatGrid::ConstPtr grid, Rebuild rebuild)
    : grid_(std::move(grid)),
      rebuild_(std::move(rebuild)),
      baked_(std::make_shared<BakedGrid>(bake(*grid_))),
      active_voxels_(grid_->activeVoxelCount())
{
}

MeshPtr GridLevelSet::surface() const
{
    std::call_once(surface_once_, [this] {
        std::vector<openvdb::Vec3s> points;
        std::vector<openvdb::Vec4I> quads;
        openvdb::tools::volumeToMesh(*grid_, points, quads, 0.0);
        auto mesh = std::make_shared<Mesh>();
        mesh->name = "level set";
        for (const openvdb::Vec3s& P : points) mesh->positions.emplace_back(P.x(), P.y(), P.z());
        for (const openvdb::Vec4I& quad : quads) {  // clockwise seen from outside
            const Eigen::Vector4i q(quad[0], quad[1], quad[2], quad[3]);
            mesh->triangles.push_back({q[0], q[2], q[1]});
            mesh->triangles.push_back({q[0], q[3], q[2]});
        }
        surface_ = std::move(mesh);
    });
    return surface_;
}

LevelSetPtr GridLevelSet::with_band(double metres) const
{
    if (metres <= band()) return shared_from_this();
    // A little more, so that rounding to the grid's single precision leaves at least `metres`.
    return std::make_shared<GridLevelSet>(rebuild_(metres * (1 + 1e-6)), rebuild_);
}

ScatterPtr GridLevelSet::surface_scatter() const { return scatter_on_surface(baked_, surface()); }
ScatterPtr GridLevelSet::volume_scatter() const { return scatter_in_volume(baked_); }

}  // namespace rapid
