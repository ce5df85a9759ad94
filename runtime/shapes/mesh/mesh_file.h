// The contents of a mesh file, before its corners are merged to vertices. For the sources that read meshes.
#pragma once

#include <filesystem>
#include <vector>

#include "runtime/deferred.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

// Importers split vertices at seams of normals and texture coordinates, and STL never shares any. A deforming sequence
// has the same corners in each file, and is merged as its first file is.
struct MeshFile {
    std::vector<Vec3f> positions;
    std::vector<Vec3f> colours;  // empty, or shape [positions]
    std::vector<float> alphas;   // empty, or shape [positions]
    std::vector<Mesh::Triangle> triangles;
};

// Error: no such file, the reader's own, a coordinate that is not finite.
RAPID_DEFERRED(read_mesh_file, MeshFile(const std::filesystem::path& path));

// The vertex of each corner: coincident corners are one vertex, numbered in the order of the file.
std::vector<std::int32_t> join_by_place(const std::vector<Vec3f>& positions);

// Error: no triangles.
MeshPtr joined(const MeshFile& file, const std::vector<std::int32_t>& vertex_of, std::string name);

}  // namespace rapid
