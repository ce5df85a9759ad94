// Meshes from files, by Assimp.
//
// A mesh is its surface: normals and texture coordinates are dropped, because at a seam a vertex has several and every
// point born on the mesh would carry them. Vertex colours become Cd, and Alpha if any is not 1.
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
#include "runtime/shapes/mesh/mesh_file.h"

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
// everything after it from one byte too late, and fails at the faces. This returns such a file with one more element in
// front of its own, an edge, whose bytes are unambiguous; nothing for any other file.
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

MeshFile read(const std::filesystem::path& path)
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

const bool defined = read_mesh_file.define(read);

}  // namespace
}  // namespace rapid
