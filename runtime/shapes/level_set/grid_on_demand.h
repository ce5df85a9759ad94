// What of a level set is OpenVDB's: its grid, for files, tools and its surface as a mesh, made when one of them asks. A
// scene that only collides with level sets of closed meshes never loads OpenVDB (runtime/deferred.h), as long as no
// pieces overlap and no band is wider than five voxels.
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
// Of a mesh with faces inside. blocks: as measured.
RAPID_DEFERRED(grid_without_faces_inside, LevelSetGridPtr(const MeshBlocks& blocks));
// Of any mesh, and with a band of any width. half_width: m. Inside of a mesh that is not balanced
// (Openness::unbalanced_edges), which has no winding number, is what is not connected to infinity in steps of a voxel
// that cross no face.
RAPID_DEFERRED(grid_of_mesh,
               LevelSetGridPtr(const Mesh& mesh, bool balanced, const VoxelFrame& frame, double half_width));

// A level set of a grid. rebuild: its surface with another half width, m.
RAPID_DEFERRED(level_set_of_grid,
               std::shared_ptr<const BakedLevelSet>(const LevelSetGridPtr& grid,
                                                    std::function<LevelSetPtr(double half_width)> rebuild));

// The zero crossing.
RAPID_DEFERRED(surface_of_grid, MeshPtr(const LevelSetGrid& grid));
// Writes it to a .vdb. name: of the grid there.
RAPID_DEFERRED(write_level_set_grid,
               void(const LevelSetGrid& grid, const std::filesystem::path& path, const std::string& name));

}  // namespace rapid
