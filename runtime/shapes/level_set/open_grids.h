// Vector grids and fogs backed by OpenVDB grids. Includes OpenVDB; vector_grid.h and density_grid.h are enough for
// queries.
#pragma once

#include <openvdb/tools/Interpolation.h>

#include <cmath>

#include "runtime/base/openvdb_grids.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/vector_grid.h"

namespace rapid {

// Samples a grid, trilinear between voxel centres. from(value): converts a value of the grid for the caller.
template <class Sampler, class Grid, class Value, class From>
void sample_grid(const Grid& grid, std::span<const Vec3d> P, std::span<Value> values, const From& from)
{
    // Not registered with the tree: registration would lock it for each batch.
    openvdb::tree::ValueAccessor<const typename Grid::TreeType, /*IsSafe=*/false> accessor(grid.tree());
    for (std::size_t i = 0; i < P.size(); ++i) {
        const openvdb::Vec3d at = grid.transform().worldToIndex({P[i].x(), P[i].y(), P[i].z()});
        // Voxel coordinates have 32 bits, so no voxels lie farther out.
        constexpr double farthest = 1 << 30;
        typename Grid::ValueType value = grid.background();
        if (std::abs(at.x()) < farthest && std::abs(at.y()) < farthest && std::abs(at.z()) < farthest)
            value = Sampler::sample(accessor, at);
        values[i] = from(value);
    }
}

class OpenVectorGrid final : public VectorGrid {
public:
    explicit OpenVectorGrid(openvdb::Vec3SGrid::ConstPtr grid) : grid_(std::move(grid)) {}

    void sample(std::span<const Vec3d> P, std::span<Vec3d> values) const override
    {
        const auto vector = [](const openvdb::Vec3s& v) { return Vec3d(v.x(), v.y(), v.z()); };
        if (grid_->getGridClass() == openvdb::GRID_STAGGERED)
            sample_grid<openvdb::tools::StaggeredBoxSampler>(*grid_, P, values, vector);
        else
            sample_grid<openvdb::tools::BoxSampler>(*grid_, P, values, vector);
    }
    const openvdb::Vec3SGrid::ConstPtr& grid() const { return grid_; }

private:
    openvdb::Vec3SGrid::ConstPtr grid_;
};

// Throws Error, before anything is created, if a density is negative or all are 0.
ScatterPtr scatter_in_fog(const openvdb::FloatGrid& grid);

class OpenDensityGrid final : public DensityGrid {
public:
    explicit OpenDensityGrid(openvdb::FloatGrid::ConstPtr grid)
        : grid_(std::move(grid)), scatter_(scatter_in_fog(*grid_))
    {
    }

    void sample(std::span<const Vec3d> P, std::span<double> values) const override
    {
        sample_grid<openvdb::tools::BoxSampler>(*grid_, P, values, [](float value) { return double(value); });
    }
    const ScatterPtr& scatter() const override { return scatter_; }
    double total() const override;
    const openvdb::FloatGrid::ConstPtr& grid() const { return grid_; }

private:
    openvdb::FloatGrid::ConstPtr grid_;
    ScatterPtr scatter_;
};

}  // namespace rapid
