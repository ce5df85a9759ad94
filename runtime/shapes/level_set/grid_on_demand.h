// The parts of a level set that need OpenVDB: its grid for files and tools, and its surface as a mesh. They are created
// on demand. A scene that only collides with level sets of closed meshes never loads OpenVDB (runtime/deferred.h), as
// long as no pieces overlap and no band is wider than five voxels.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "runtime/deferred.h"
#include "runtime/shapes/level_set/level_set.h"

namespace rapid {

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

}  // namespace rapid
