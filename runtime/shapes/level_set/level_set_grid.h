// A level set on an OpenVDB grid, and the functions that build it. Includes OpenVDB; level_set.h is enough for queries.
#pragma once

#include <openvdb/openvdb.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string_view>

#include "runtime/shapes/first_contact.h"
#include "runtime/shapes/level_set/baked_grid.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/scatter_level_set.h"

namespace rapid {

// Copies the band of a level set for queries. The grid's map must be a uniform scale and a translation.
BakedGrid bake(const openvdb::FloatGrid& grid);

class GridLevelSet final : public ShapeOf<GridLevelSet, LevelSet>, public std::enable_shared_from_this<GridLevelSet> {
public:
    // Builds the same surface with another half width, in metres: from the grid's own source if that is known.
    using Rebuild = std::function<openvdb::FloatGrid::Ptr(double half_width)>;

    // The grid is shared from here on, and must not change.
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

// The signed distance from a mesh, m, in a band of `half_width` metres on each side. Inside is where the winding number
// is not 0, so pieces may overlap, all faces may look inwards, and a piece that faces inwards inside another is a
// cavity. A mesh that is not balanced (Openness::unbalanced_edges) has no winding number: then outside is the region
// that is connected to infinity in steps of a voxel that cross no face.
openvdb::FloatGrid::Ptr signed_distance(const Mesh& mesh, bool balanced, const openvdb::math::Transform& transform,
                                        double half_width);

// A grid without a known source, widened from its own surface: new voxels get their distance to it as a mesh, and the
// existing ones keep their values to the bit.
openvdb::FloatGrid::Ptr widened(const openvdb::FloatGrid& grid, double half_width);

// The surface of any level set on other voxels, by its mesh.
openvdb::FloatGrid::Ptr resampled_to(const LevelSetPtr& shape, const openvdb::math::Transform& transform,
                                     double half_width);

// Registers OpenVDB's types; call it before the first grid is made or read.
void initialize_openvdb();

// Error: a voxel or half width out of range.
void require_legal(const LevelSetOptions& options);

// Error, before anything is built, when a level set of a surface of this area (m²) in these bounds would have over 2^31
// voxels, too large an index, or more memory than the machine has. what: its name, `mesh "bunny.obj"`.
void require_buildable(std::string_view what, double area, const Box3d& bounds, const LevelSetOptions& options);

// Voxel centres at multiples of `voxel`, so that level sets of one voxel size combine without resampling. Far from the
// origin it is shifted by whole voxels, because some of OpenVDB's index coordinates are in single precision.
openvdb::math::Transform::Ptr make_transform(double voxel, const Box3d& bounds);

}  // namespace rapid
