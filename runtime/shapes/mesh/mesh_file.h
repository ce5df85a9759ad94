// The contents of a mesh file before its corners are merged into vertices. For code that reads meshes.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "runtime/base/deferred.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

// Importers split vertices at seams of normals and texture coordinates, and STL never shares any. Every file of a
// deforming sequence has the same corners and is merged like its first file.
struct MeshFile {
    std::vector<Vec3f> positions;
    std::vector<Vec3f> colours;                        // empty, or shape [positions]
    std::vector<float> alphas;                         // empty, or shape [positions]
    std::map<std::string, Mesh::VertexValues> values;  // other attributes, each of shape [positions]
    std::vector<Mesh::Triangle> triangles;
    std::map<std::string, Mesh::VertexValues> face_values;         // each of shape [triangles]
    std::map<std::string, std::vector<std::uint8_t>> face_groups;  // each of shape [triangles]
    std::vector<std::string> skipped;
};

// Reads a mesh file. Throws Error if it does not exist, cannot be parsed, has an index without a vertex, or a
// coordinate that is not finite.
MeshFile read_mesh_file(const std::filesystem::path& path);

// The readers. Their errors do not name the file. The PLY reader validates everything; Assimp, which reads the other
// formats, trusts the file (read_sandboxed.h).
MeshFile read_ply_mesh(const std::filesystem::path& path);
RAPID_DEFERRED(import_mesh, MeshFile(const std::filesystem::path& path));

// Returns the vertex of each corner. Coincident corners become one vertex; vertices are numbered in file order.
std::vector<std::int32_t> join_by_position(const std::vector<Vec3f>& positions);

// Throws Error if there are no triangles.
MeshPtr joined(const MeshFile& file, const std::vector<std::int32_t>& vertex_of, std::string name);

}  // namespace rapid
