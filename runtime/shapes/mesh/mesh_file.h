// The contents of a mesh file before its corners are merged into vertices. For code that reads meshes.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

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

// The readers. They validate everything. Their errors do not name the file.
MeshFile read_gltf_mesh(const std::filesystem::path& path);
MeshFile read_obj_mesh(const std::filesystem::path& path);
MeshFile read_ply_mesh(const std::filesystem::path& path);
MeshFile read_stl_mesh(const std::filesystem::path& path);

// Collects the names of the groups that triangles are in.
class GroupsOfFaces {
public:
    // Returns an index for append(). An empty name is no group.
    std::size_t add_names(std::set<std::string> names);
    // Puts the triangles up to this count, from the last call's, in the groups of `names`.
    void append(std::size_t triangles, std::size_t names) { names_of_triangles_.resize(triangles, names); }
    // Throws Error if the groups do not fit in memory: a file of n names and n triangles needs n² bytes.
    void add_to(MeshFile& mesh) const;

private:
    std::vector<std::set<std::string>> names_;
    std::vector<std::size_t> names_of_triangles_;
};

// Returns the vertex of each corner. Coincident corners become one vertex; vertices are numbered in file order.
std::vector<std::int32_t> join_by_position(const std::vector<Vec3f>& positions);

// Throws Error if there are no triangles.
MeshPtr joined(const MeshFile& file, const std::vector<std::int32_t>& vertex_of, std::string name);

}  // namespace rapid
