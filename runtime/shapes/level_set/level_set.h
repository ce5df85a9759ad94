// A narrow-band level set: the general shape that particles collide with (paper §4).
//
// Queries run on a flat table of its blocks behind a coarse index (baked_grid.h), because a sample of OpenVDB's tree
// costs several times more. Its grid is for tools and files, and is made when one asks for it (grid_on_demand.h).
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "runtime/deferred.h"
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
    MeshPtr surface() const override = 0;  // the zero crossing as a mesh
    // The same surface with a band of at least `metres` on each side; this one where it is wide enough.
    virtual std::shared_ptr<const LevelSet> with_band(double metres) const = 0;
    virtual void write(const std::filesystem::path& path, const std::string& grid) const = 0;
};

using LevelSetPtr = std::shared_ptr<const LevelSet>;

// Inside is where the winding number of the mesh is not 0: pieces may overlap, and one that faces inwards inside
// another is a cavity. Holes smaller than a voxel are closed (see grid_on_demand.h).
//
// `warnings` collects what is doubtful but usable (a mesh with holes, faces turned inside out), with the numbers.
// Errors: a voxel size that would take over 2^31 voxels, or that is larger than the mesh (which would vanish), an empty
// mesh.
LevelSetPtr level_set_from_mesh(const MeshPtr& mesh, const LevelSetOptions& options,
                                std::vector<std::string>& warnings);
// Of a mesh with the faces of an earlier one, whose openness is known; without its checks and warnings.
LevelSetPtr level_set_of_same_faces(const MeshPtr& mesh, const LevelSetOptions& options, const Mesh::Openness& open);
LevelSetPtr level_set_sphere(double radius, const Vec3d& center, const LevelSetOptions& options);
LevelSetPtr level_set_box(const Vec3d& size, const Vec3d& center, const LevelSetOptions& options);
LevelSetPtr level_set_torus(double radius, double tube, const Vec3d& center, const LevelSetOptions& options);

// grid: empty for the only level set in the file. Error: no such file, not a .vdb, no such grid (with the names that
// there are), not a float level set, an empty grid, a map that is not uniform scale and translation.
RAPID_DEFERRED(read_level_set, LevelSetPtr(const std::filesystem::path& path, const std::string& grid));

}  // namespace rapid
