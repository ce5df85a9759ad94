// Meshes from files, by Assimp.
//
// A mesh is its surface: normals and texture coordinates are left behind, because at a seam a vertex has several and
// every point born on the mesh would carry them. Vertex colours become Cd, and Alpha where any is not 1.
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <bit>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <unordered_map>

#include "runtime/error.h"
#include "runtime/shapes/mesh_file.h"

namespace rapid {
namespace {

void append(const aiMesh& part, const aiMatrix4x4& to_world, MeshFile& corners)
{
    const auto first = corners.positions.size();
    const bool moved = !to_world.IsIdentity();
    for (unsigned i = 0; i < part.mNumVertices; ++i) {
        const aiVector3D P = moved ? to_world * part.mVertices[i] : part.mVertices[i];
        corners.positions.emplace_back(P.x, P.y, P.z);
    }
    if (part.HasVertexColors(0)) {
        corners.colours.resize(first, Vec3f::Ones());  // parts without colours are white
        corners.alphas.resize(first, 1.0f);
        for (unsigned i = 0; i < part.mNumVertices; ++i) {
            const aiColor4D& colour = part.mColors[0][i];
            corners.colours.emplace_back(colour.r, colour.g, colour.b);
            corners.alphas.push_back(colour.a);
        }
    }
    const bool mirrored = to_world.Determinant() < 0;
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
        const aiFace& face = part.mFaces[f];
        if (face.mNumIndices != 3) continue;  // lines and points, which have no surface
        Mesh::Triangle t;
        for (int k = 0; k < 3; ++k) t[k] = static_cast<std::int32_t>(first + face.mIndices[k]);
        if (mirrored) std::swap(t[1], t[2]);
        corners.triangles.push_back(t);
    }
}

void append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& to_parent, MeshFile& corners)
{
    const aiMatrix4x4 to_world = to_parent * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) append(*scene.mMeshes[node.mMeshes[i]], to_world, corners);
    for (unsigned i = 0; i < node.mNumChildren; ++i) append(scene, *node.mChildren[i], to_world, corners);
}

std::string lower_case(std::string text)
{
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
    return text;
}

// Assimp takes a byte at the beginning of a binary file's data that could end a line for a part of the header, reads
// all that follows from one byte too late, and falls over the faces. Such a file comes back with one more element in
// front of its own, an edge, whose bytes cannot be mistaken; nothing where the file is none of these.
std::optional<std::string> with_safe_beginning(const std::filesystem::path& path)
{
    std::ifstream file(path, std::ios::binary);
    std::string header, line;
    std::size_t elements = 0;
    while (std::getline(file, line)) {
        if (header.empty() && !line.starts_with("ply")) return {};
        if (elements == 0 && line.starts_with("element ")) elements = header.size();
        if (line.starts_with("format ascii")) return {};
        header += line + '\n';
        if (line.starts_with("end_header")) break;
    }
    const int first = file.peek();
    if (!(elements > 0 && (first == '\n' || first == '\r'))) return {};
    header.insert(elements, "element edge 1\nproperty int vertex1\n");
    return header + "edge" + std::string(std::istreambuf_iterator<char>(file), {});
}

MeshFile import(const std::filesystem::path& path)
{
    Assimp::Importer importer;
    const std::optional<std::string> safe =
        lower_case(path.extension().string()) == ".ply" ? with_safe_beginning(path) : std::nullopt;
    const aiScene* scene = safe ? importer.ReadFileFromMemory(safe->data(), safe->size(), aiProcess_Triangulate, "ply")
                                : importer.ReadFile(path.string(), aiProcess_Triangulate);
    if (!scene)
        throw Error(fmt::format("cannot read the mesh \"{}\": {}; it must be an OBJ, PLY, STL or glTF file",
                                path.string(), importer.GetErrorString()));
    MeshFile corners;
    if (scene->mRootNode) append(*scene, *scene->mRootNode, aiMatrix4x4(), corners);
    if (!corners.colours.empty()) {
        corners.colours.resize(corners.positions.size(), Vec3f::Ones());
        corners.alphas.resize(corners.positions.size(), 1.0f);
    }
    return corners;
}

}  // namespace

MeshFile read_mesh_file(const std::filesystem::path& path)
{
    if (!std::filesystem::exists(path)) throw Error(fmt::format("there is no mesh file \"{}\"", path.string()));
    static const std::vector<std::string> extensions{".obj", ".ply", ".stl", ".gltf", ".glb"};
    const std::string extension = lower_case(path.extension().string());
    if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end())
        throw Error(fmt::format(
            "\"{}\" is not a mesh file that can be read; it must be .obj, .ply, .stl, .gltf or .glb", path.string()));

    MeshFile file = import(path);
    for (std::size_t i = 0; i < file.positions.size(); ++i)
        if (!file.positions[i].allFinite())
            throw Error(fmt::format("vertex {} of the mesh \"{}\" is at ({}, {}, {}); coordinates must be finite", i,
                                    path.string(), file.positions[i].x(), file.positions[i].y(),
                                    file.positions[i].z()));
    return file;
}

std::vector<std::int32_t> join_by_place(const std::vector<Vec3f>& positions)
{
    struct Hash {
        std::size_t operator()(const std::array<std::uint32_t, 3>& bits) const
        {
            std::uint64_t hash = 0;
            for (const std::uint32_t word : bits) hash = (hash ^ word) * 0x9E3779B97F4A7C15ull, hash ^= hash >> 29;
            return hash;
        }
    };
    std::unordered_map<std::array<std::uint32_t, 3>, std::int32_t, Hash> vertices;
    vertices.reserve(positions.size());
    std::vector<std::int32_t> vertex_of(positions.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
        std::array<std::uint32_t, 3> place;
        for (int axis = 0; axis < 3; ++axis)
            place[axis] = std::bit_cast<std::uint32_t>(positions[i][axis] + 0.0f);  // -0 is 0
        vertex_of[i] = vertices.try_emplace(place, static_cast<std::int32_t>(vertices.size())).first->second;
    }
    return vertex_of;
}

MeshPtr joined(const MeshFile& file, const std::vector<std::int32_t>& vertex_of, std::string name)
{
    auto mesh = std::make_shared<Mesh>();
    mesh->name = std::move(name);
    std::vector<Vec3f> colours;
    std::vector<float> alphas;
    for (std::size_t i = 0; i < file.positions.size(); ++i) {
        if (vertex_of[i] != static_cast<std::int32_t>(mesh->positions.size())) continue;  // not the first of its place
        mesh->positions.push_back(file.positions[i]);
        if (!file.colours.empty()) {
            colours.push_back(file.colours[i]);
            alphas.push_back(file.alphas[i]);
        }
    }
    for (const Mesh::Triangle& t : file.triangles) {
        const Mesh::Triangle joined(vertex_of[t[0]], vertex_of[t[1]], vertex_of[t[2]]);
        // A face whose corners fell together is a line, and its edges cancel: what it bounded is closed without it.
        if (joined[0] != joined[1] && joined[1] != joined[2] && joined[2] != joined[0])
            mesh->triangles.push_back(joined);
    }
    if (mesh->triangles.empty())
        throw Error(fmt::format("the mesh \"{}\" has {} vertices and no faces; a mesh needs at least one triangle",
                                mesh->name, mesh->positions.size()));

    if (std::any_of(alphas.begin(), alphas.end(), [](float alpha) { return alpha != 1.0f; }))
        mesh->values.emplace("Alpha", std::move(alphas));
    if (!colours.empty()) mesh->values.emplace("Cd", std::move(colours));
    return mesh;
}

MeshPtr read_mesh(const std::filesystem::path& path)
{
    const MeshFile file = read_mesh_file(path);
    return joined(file, join_by_place(file.positions), path.string());
}

}  // namespace rapid
