// What the sources of level_set_*.cpp share: an OpenVDB grid made into a LevelSet. Brings OpenVDB with it; whoever only
// asks level sets includes level_set.h.
#pragma once

#include <openvdb/openvdb.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string_view>

#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/level_set/baked_grid.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/scatter/scatter.h"

namespace rapid {

// Copies the band of a level set for asking. The grid's map must be a uniform scale and a translation.
BakedGrid bake(const openvdb::FloatGrid& grid);

class GridLevelSet final : public ShapeOf<GridLevelSet, LevelSet>, public std::enable_shared_from_this<GridLevelSet> {
public:
    // Makes the same surface with another half width, in metres: from what the grid was made from where that is known.
    using Rebuild = std::function<openvdb::FloatGrid::Ptr(double half_width)>;

    // The grid is shared, and not to be changed any more.
    GridLevelSet(openvdb::FloatGrid::ConstPtr grid, Rebuild rebuild);

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

    const openvdb::FloatGrid& grid() const { return *grid_; }
    const openvdb::FloatGrid::ConstPtr& shared_grid() const { return grid_; }
    const BakedGrid& baked() const { return *baked_; }
    bool has_surface() const { return baked_->crossings > 0; }

private:
    openvdb::FloatGrid::ConstPtr grid_;
    Rebuild rebuild_;
    std::shared_ptr<const BakedGrid> baked_;  // shared with the scatters made from this
    std::uint64_t active_voxels_;
    mutable std::once_flag surface_once_;
    mutable MeshPtr surface_;
};

// The signed distance from a mesh, m, in a band of `half_width` metres on each side. The sign rule: inside is where the
// faces wind around a place (their winding number is not 0), so pieces may overlap, all faces may look inwards, and a
// piece that is turned inwards inside another is a cavity. A mesh that is not balanced (Openness::unbalanced_edges) has
// no winding number: then outside is what can be reached from far away without crossing a face, in steps of a voxel.
openvdb::FloatGrid::Ptr signed_distance(const Mesh& mesh, bool balanced, const openvdb::math::Transform& transform,
                                        double half_width);

// A grid without a known origin, widened from its own surface: new voxels get their distance to it as a mesh, and those
// that there are keep their values to the bit.
openvdb::FloatGrid::Ptr widened(const openvdb::FloatGrid& grid, double half_width);

// The surface of any level set on other voxels, from it as a mesh.
openvdb::FloatGrid::Ptr resampled_to(const LevelSetPtr& shape, const openvdb::math::Transform& transform,
                                     double half_width);

// Registers OpenVDB's types; call it before the first grid is made or read.
void initialize_openvdb();

// Error: a voxel or half width out of range.
void require_legal(const LevelSetOptions& options);

// Error, before anything is built, when a level set of a surface of this area (m²) in these bounds would have over 2^31
// voxels, too large an index, or more memory than the machine has. `what` names it: `mesh "bunny.obj"`.
void require_buildable(std::string_view what, double area, const Box3d& bounds, const LevelSetOptions& options);

// Voxel centres at multiples of `voxel`, so that level sets of one voxel size combine without resampling. Far from the
// origin it is moved by whole voxels, because OpenVDB's index coordinates are single precision in places.
openvdb::math::Transform::Ptr make_transform(double voxel, const Box3d& bounds);

}  // namespace rapid
