#include "runtime/shapes/level_set/scatter_level_set.h"

#include <algorithm>
#include <cmath>

#include "runtime/shapes/level_set/baked_grid.h"
#include "runtime/shapes/scatter/scatter_in_cells.h"

namespace rapid {
namespace {

// Positions on the extracted mesh, moved along the gradient to the zero crossing of the field. The mesh is flat between
// its vertices, with an error of up to voxel² / (8 radius).
class ScatterOnLevelSet final : public Scatter {
public:
    ScatterOnLevelSet(std::shared_ptr<const BakedGrid> grid, const MeshPtr& surface)
        : grid_(std::move(grid)), on_mesh_(scatter_on_surface(surface))
    {
    }

    void place(RandomKey key, std::uint64_t first, std::span<Birthplace> out) const override
    {
        // Newton's method along the gradient. The field is nearly affine there: one or two steps suffice, except at
        // creases.
        constexpr int max_steps = 8;
        const double near = 1e-6 * grid_->voxel;  // m
        on_mesh_->place(key, first, out);
        const BakedSampler sampler(*grid_);
        for (Birthplace& birth : out) {
            Vec3d P = birth.P.cast<double>(), gradient;
            double phi = sampler.distance(P, gradient);
            for (int i = 0; i < max_steps && std::abs(phi) > near && gradient.squaredNorm() > 0; ++i) {
                const Vec3d step = phi / gradient.squaredNorm() * gradient;
                P -= step * std::min(1.0, grid_->voxel / step.norm());  // at most one voxel
                phi = sampler.distance(P, gradient);
            }
            birth.P = P.cast<float>();
            if (gradient.squaredNorm() > 0) birth.N = gradient.normalized().cast<float>();
            birth.element = -1;
            birth.b1 = birth.b2 = 0;
        }
    }

private:
    std::shared_ptr<const BakedGrid> grid_;
    ScatterPtr on_mesh_;
};

struct BelowZero {
    std::shared_ptr<const BakedGrid> grid;

    bool operator()(const Vec3f& P) const { return BakedSampler(*grid).distance(P.cast<double>()) < 0; }
};

}  // namespace

ScatterPtr scatter_on_surface(std::shared_ptr<const BakedGrid> grid, const MeshPtr& surface)
{
    return std::make_shared<ScatterOnLevelSet>(std::move(grid), surface);
}

ScatterPtr scatter_in_volume(std::shared_ptr<const BakedGrid> grid)
{
    ScatterCells cells;
    cells.origin = grid->origin;
    cells.edge = Vec3d::Constant(grid->voxel * BakedGrid::block);
    cells.counts = grid->blocks;
    std::vector<std::uint32_t> partly;
    std::uint64_t negative = 0;  // voxels
    for (std::uint32_t block = 0; block < grid->index.size(); ++block) {
        const std::int32_t code = grid->index[block];
        if (code < 0) {
            if (BakedGrid::is_outside(code)) continue;
            cells.cells.push_back(block);
            negative += 512;
            continue;
        }
        const float* values = grid->values.data() + std::size_t(code) * BakedGrid::block_values;
        const auto below = std::count_if(values, values + BakedGrid::block_values, [](float phi) { return phi < 0; });
        negative += static_cast<std::uint64_t>(below) * 512 / BakedGrid::block_values;
        if (below == BakedGrid::block_values)
            cells.cells.push_back(block);
        else if (below > 0)
            partly.push_back(block);
    }
    cells.whole = cells.cells.size();
    cells.cells.insert(cells.cells.end(), partly.begin(), partly.end());
    const double volume = std::max<double>(double(negative), 1) * std::pow(grid->voxel, 3);
    BelowZero inside{std::move(grid)};
    return std::make_shared<ScatterInCells<BelowZero>>(std::move(cells), std::move(inside), volume, "the level set");
}

}  // namespace rapid
