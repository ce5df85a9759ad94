// A level set for queries, based on a BakedGrid. Its OpenVDB grid is created on demand.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "runtime/base/deferred.h"
#include "runtime/base/in_motion.h"
#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/level_set/baked_grid.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

// The parts of a level set that need OpenVDB: its grid for files and tools, and its surface as a mesh. They are created
// on demand. A scene that only collides with level sets of closed meshes never loads OpenVDB (runtime/base/deferred.h),
// as long as no pieces overlap and no band is wider than five voxels.

class BakedLevelSet;
struct LevelSetGrid;  // level_set_grid.h
struct MeshBlocks;
struct VoxelBlocks;
struct VoxelFrame;
using LevelSetGridPtr = std::shared_ptr<const LevelSetGrid>;

RAPID_DEFERRED(grid_of_blocks, LevelSetGridPtr(const VoxelBlocks& blocks));
// Builds the grid of any mesh with a band of any width. half_width: m. measured: the blocks of this mesh and band if
// measure() has made them, else null. A mesh that is not balanced (Openness::unbalanced_edges) has no winding number.
// Its inside is then everything that is not connected to infinity by steps of one voxel that cross no face.
RAPID_DEFERRED(grid_of_mesh, LevelSetGridPtr(const Mesh& mesh, bool balanced, const VoxelFrame& frame,
                                             double half_width, const MeshBlocks* measured));

// Creates a level set from a grid. rebuild: creates the same surface with another half width, m.
RAPID_DEFERRED(level_set_of_grid,
               std::shared_ptr<const BakedLevelSet>(const LevelSetGridPtr& grid,
                                                    std::function<LevelSetPtr(double half_width)> rebuild));

// Returns the zero crossing as a mesh.
RAPID_DEFERRED(surface_of_grid, MeshPtr(const LevelSetGrid& grid));
// Writes a .vdb file. name: name of the grid in it.
RAPID_DEFERRED(write_level_set_grid,
               void(const LevelSetGrid& grid, const std::filesystem::path& path, const std::string& name));

class BakedLevelSet final : public ShapeOf<BakedLevelSet, LevelSet>,
                            public StateInMotion,
                            public std::enable_shared_from_this<BakedLevelSet> {
public:
    // Functions that recreate the data that the baked grid lacks.
    struct Source {
        std::function<LevelSetGridPtr()> grid;
        std::function<LevelSetPtr(double half_width)> rebuild;  // the same surface with another half width, m
    };

    BakedLevelSet(BakedGrid baked, std::uint64_t active_voxels, Source source);
    // Creates the same level set as a state of a moving one. It shares the grid with `same`, and keeps it alive.
    BakedLevelSet(const std::shared_ptr<const BakedLevelSet>& same, ObjectPtr moving);
    ObjectPtr in_motion() const override { return moving_; }

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
    std::shared_ptr<const BakedLevelSet> same_;
    ObjectPtr moving_;
    mutable std::mutex grid_mutex_, surface_mutex_;
    mutable LevelSetGridPtr grid_;
    mutable MeshPtr surface_;
};

}  // namespace rapid
