// A narrow-band level set: the general shape that particles collide with (paper §4).
//
// Queries use a flat table of blocks with a coarse index (baked_grid.h), because a sample of OpenVDB's tree costs
// several times more. The OpenVDB grid is for tools and files and is created on demand (baked_level_set.h).
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/base/deferred.h"
#include "runtime/shapes/mesh/mesh.h"
#include "runtime/shapes/shape.h"

namespace rapid {

struct LevelSetOptions {
    double voxel = 0.1;     // m
    double half_width = 3;  // voxels on each side of the surface
};

class LevelSet : public Shape {
public:
    static constexpr std::string_view param_type = "level set";
    std::string_view kind() const override { return "level set"; }

    virtual double voxel() const = 0;  // m
    virtual std::uint64_t active_voxels() const = 0;
    MeshPtr surface() const override = 0;  // the zero crossing
    // Returns the same surface with a band of at least `metres` on each side, or this level set if its band is wide
    // enough.
    virtual std::shared_ptr<const LevelSet> with_band(double metres) const = 0;
    virtual void write(const std::filesystem::path& path, const std::string& grid) const = 0;
};

using LevelSetPtr = std::shared_ptr<const LevelSet>;

// Builds the level set of a mesh. The inside is where the winding number of the mesh is not 0: pieces may overlap, and
// an inward-facing piece inside another is a cavity. Holes smaller than a voxel are closed (see baked_level_set.h).
//
// Problems that still give a usable level set (holes, faces turned inside out) are appended to `warnings`, with
// numbers. Throws Error if the mesh is empty, or if the voxel size would need over 2^31 voxels or is larger than the
// mesh, which would then vanish.
LevelSetPtr level_set_from_mesh(const MeshPtr& mesh, const LevelSetOptions& options,
                                std::vector<std::string>& warnings);
// Builds the level set of a mesh with the faces of an earlier one, whose openness is known. Skips its checks and
// warnings.
LevelSetPtr level_set_of_same_faces(const MeshPtr& mesh, const LevelSetOptions& options, const Mesh::Openness& open);
LevelSetPtr level_set_sphere(double radius, const Vec3d& center, const LevelSetOptions& options);
LevelSetPtr level_set_box(const Vec3d& size, const Vec3d& center, const LevelSetOptions& options);
LevelSetPtr level_set_torus(double radius, double tube, const Vec3d& center, const LevelSetOptions& options);

// grid: empty for the only level set in the file. Throws Error if the file does not exist or is not a .vdb, if it has
// no such grid (the message lists those it has), or if the grid is empty, is not a float level set, or has a map other
// than a uniform scale and translation.
RAPID_DEFERRED(read_level_set, LevelSetPtr(const std::filesystem::path& path, const std::string& grid));

// Throws Error if the voxel size or the half width is out of range.
void require_legal(const LevelSetOptions& options);

// Throws Error, before anything is built, if a level set of a surface of this area (m²) in these bounds would have over
// 2^31 voxels, too large an index, or need more memory than the machine has. what: its name in the message, `mesh
// "bunny.obj"`.
void require_buildable(std::string_view what, double area, const Box3d& bounds, const LevelSetOptions& options);

// The smallest voxel edge of a grid. OpenVDB refuses a map whose determinant is below 1e-15 m³.
constexpr double min_voxel = 2e-5;  // m

}  // namespace rapid
