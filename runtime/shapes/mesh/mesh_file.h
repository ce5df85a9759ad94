// The contents of a mesh file, before its corners are merged to vertices. For the sources that read meshes.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "runtime/deferred.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

// Importers split vertices at seams of normals and texture coordinates, and STL never shares any. A deforming sequence
// has the same corners in each file, and is merged as its first file is.
struct MeshFile {
    std::vector<Vec3f> positions;
    std::vector<Vec3f> colours;                        // empty, or shape [positions]
    std::vector<float> alphas;                         // empty, or shape [positions]
    std::map<std::string, Mesh::VertexValues> values;  // others, each of shape [positions]
    std::vector<Mesh::Triangle> triangles;
    std::map<std::string, Mesh::VertexValues> face_values;         // each of shape [triangles]
    std::map<std::string, std::vector<std::uint8_t>> face_groups;  // likewise
    std::vector<std::string> left_out;
};

// Error: no such file, the reader's own, an index without a vertex, a coordinate that is not finite.
MeshFile read_mesh_file(const std::filesystem::path& path);

// Its readers, which name no file in their errors: of PLY, which trusts nothing; and of all else, by Assimp, which
// trusts the file (read_apart.h).
MeshFile read_ply_mesh(const std::filesystem::path& path);
RAPID_DEFERRED(import_mesh, MeshFile(const std::filesystem::path& path));

// The vertex of each corner: coincident corners are one vertex, numbered in the order of the file.
std::vector<std::int32_t> join_by_place(const std::vector<Vec3f>& positions);

// Error: no triangles.
MeshPtr joined(const MeshFile& file, const std::vector<std::int32_t>& vertex_of, std::string name);

}  // namespace rapid
