// A level set for queries, based on a BakedGrid. Its OpenVDB grid is created on demand.
#pragma once

#include <functional>
#include <memory>
#include <mutex>

#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/level_set/baked_grid.h"
#include "runtime/shapes/level_set/grid_on_demand.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

class BakedLevelSet final : public ShapeOf<BakedLevelSet, LevelSet>,
                            public std::enable_shared_from_this<BakedLevelSet> {
public:
    // Functions that recreate the data that the baked grid lacks.
    struct Source {
        std::function<LevelSetGridPtr()> grid;
        std::function<LevelSetPtr(double half_width)> rebuild;  // the same surface with another half width, m
    };

    BakedLevelSet(BakedGrid baked, std::uint64_t active_voxels, Source source);

    BakedSampler sampler() const { return BakedSampler(*baked_); }
    Box3d bounds() const override { return sampler().bounds(); }
    double band() const override { return baked_->background; }
    double slope_bound() const override { return baked_->slope; }

    double voxel() const override { return baked_->voxel; }
    std::uint64_t active_voxels() const override { return active_voxels_; }
    MeshPtr surface() const override;
    LevelSetPtr with_band(double metres) const override;
    void write(const std::filesystem::path& path, const std::string& grid) const override;

    ScatterPtr surface_scatter() const override;
    ScatterPtr volume_scatter() const override;

    const LevelSetGridPtr& grid() const;  // created by the first call
    const BakedGrid& baked() const { return *baked_; }
    bool has_surface() const { return baked_->crossings > 0; }

private:
    std::shared_ptr<const BakedGrid> baked_;  // shared with the scatters of this level set
    std::uint64_t active_voxels_;
    Source source_;
    mutable std::mutex grid_mutex_, surface_mutex_;
    mutable LevelSetGridPtr grid_;
    mutable MeshPtr surface_;
};

}  // namespace rapid
