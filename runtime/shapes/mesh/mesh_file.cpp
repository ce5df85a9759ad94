// Reads meshes with Assimp: OBJ, STL and glTF.
//
// Vertex colours become Cd, and Alpha if any is not 1. Normals become N, except for STL, which only has face normals.
// Texture coordinates become uv, uv2, uv3, ..., and _NAME in glTF becomes NAME. Faces are in groups named after their
// part, the node that has it, and their material. Skins, animations, morph targets, lights and cameras are ignored.
#include "runtime/shapes/mesh/mesh_file.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/files/input_file.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/shapes/mesh/gltf_attributes.h"

namespace rapid {
namespace {

// Checks the end of text mesh files, because Assimp accepts truncated ones.

// Returns up to `most` bytes from a position of the file.
std::string read_at(std::ifstream& file, std::size_t position, std::size_t most)
{
    std::string bytes(most, '\0');
    file.seekg(static_cast<std::streamoff>(position));
    file.read(bytes.data(), static_cast<std::streamsize>(most));
    bytes.resize(static_cast<std::size_t>(file.gcount()));
    return bytes;
}

// Returns the last line that is not white space, or its end if it is longer than the text.
std::string last_line(std::string_view end_of_text)
{
    const std::string_view text = end_of_text.substr(0, end_of_text.find_last_not_of(" \t\r\n") + 1);
    return std::string(text.substr(text.find_last_of("\r\n") + 1));
}

bool is_text_stl(std::ifstream& file, std::size_t size)
{
    constexpr std::size_t header = 80, facet = 50;
    const std::string head = read_at(file, 0, header + sizeof(std::uint32_t));
    std::uint32_t facets = 0;
    if (head.size() == header + sizeof facets) {
        std::memcpy(&facets, head.data() + header, sizeof facets);
        if (size == head.size() + std::uint64_t{facet} * facets) return false;
    }
    return std::string_view(head).substr(std::min(head.find_first_not_of(" \t"), head.size())).starts_with("solid");
}

// Throws Error if a text .stl does not end with "endsolid". Accepts all other files.
void check_text_end(const std::filesystem::path& path)
{
    const std::size_t size = check_readable(path);
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension != ".stl") return;
    std::ifstream file(path, std::ios::binary);
    constexpr std::size_t most = 4096;
    const std::string end = read_at(file, size - std::min(size, most), std::min(size, most));
    if (is_text_stl(file, size) && !last_line(end).starts_with("endsolid"))
        throw Error("the file ends early: its last line is not \"endsolid\"");
}

template <class T>
T zero()
{
    if constexpr (std::is_same_v<T, Vec3f>)
        return Vec3f::Zero();
    else
        return 0;
}

// Appends a value per corner. Earlier corners without one get 0.
template <class T>
void append_list(const std::string& name, const std::vector<T>& list, std::size_t first, MeshFile& corners)
{
    Mesh::VertexValues& values = corners.values.try_emplace(name, std::vector<T>()).first->second;
    auto* known = std::get_if<std::vector<T>>(&values);
    if (!known)
        return add_skipped(corners.skipped,
                           fmt::format("\"{}\" of a part, which has another type in other parts", name));
    known->resize(first, zero<T>());
    known->insert(known->end(), list.begin(), list.end());
}

void append_values(const aiMesh& part, const aiMatrix4x4& to_world, std::size_t first, bool with_normals,
                   MeshFile& corners)
{
    const auto append = [&](const std::string& name, const auto& value_of) {
        std::vector<Vec3f> list;
        for (unsigned i = 0; i < part.mNumVertices; ++i) {
            const aiVector3D value = value_of(i);
            list.emplace_back(value.x, value.y, value.z);
        }
        append_list(name, list, first, corners);
    };
    for (unsigned set = 0; set < AI_MAX_NUMBER_OF_TEXTURECOORDS; ++set)
        if (part.HasTextureCoords(set))
            append(set == 0 ? "uv" : fmt::format("uv{}", set + 1),
                   [&](unsigned i) { return part.mTextureCoords[set][i]; });
    if (!with_normals || !part.HasNormals()) return;
    aiMatrix3x3 turn(to_world);
    turn.Inverse().Transpose();
    append("N", [&](unsigned i) { return (turn * part.mNormals[i]).NormalizeSafe(); });
}

// Adds the triangles from `first` on to a group.
void join_group(const std::string& name, std::size_t first, MeshFile& corners)
{
    if (name.empty()) return;
    std::vector<std::uint8_t>& members = corners.face_groups[name];
    members.resize(first, 0);
    members.resize(corners.triangles.size(), 1);
}

// The additional attributes of each part, by its index.
using PartValues = std::vector<std::map<std::string, Mesh::VertexValues>>;

void append(const aiScene& scene, unsigned number, const std::string& node, const aiMatrix4x4& to_world,
            bool with_normals, const PartValues& values, MeshFile& corners)
{
    const aiMesh& part = *scene.mMeshes[number];
    const auto first = corners.positions.size(), first_face = corners.triangles.size();
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
        if (face.mNumIndices != 3) continue;  // lines and points have no surface
        Mesh::Triangle t;
        for (int k = 0; k < 3; ++k) {
            if (face.mIndices[k] >= part.mNumVertices)
                throw Error(
                    fmt::format("a face has the vertex {}; there are {}, from 0", face.mIndices[k], part.mNumVertices));
            t[k] = static_cast<std::int32_t>(first + face.mIndices[k]);
        }
        if (mirrored) std::swap(t[1], t[2]);
        corners.triangles.push_back(t);
    }
    append_values(part, to_world, first, with_normals, corners);
    if (number < values.size())
        for (const auto& [name, any] : values[number])
            std::visit([&, &key = name](const auto& list) { append_list(key, list, first, corners); }, any);
    std::set<std::string> groups = {part.mName.C_Str(), node};
    if (part.mMaterialIndex < scene.mNumMaterials) {
        const std::string material = scene.mMaterials[part.mMaterialIndex]->GetName().C_Str();
        if (material != AI_DEFAULT_MATERIAL_NAME) groups.insert(material);
    }
    for (const std::string& name : groups) join_group(name, first_face, corners);
    if (part.HasBones()) add_skipped(corners.skipped, "its skin");
    if (part.mNumAnimMeshes > 0) add_skipped(corners.skipped, "its morph targets");
}

void append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& to_parent, bool with_normals,
            const PartValues& values, MeshFile& corners)
{
    const aiMatrix4x4 to_world = to_parent * node.mTransformation;
    const std::string name = node.mName.C_Str();
    for (unsigned i = 0; i < node.mNumMeshes; ++i)
        append(scene, node.mMeshes[i], name, to_world, with_normals, values, corners);
    for (unsigned i = 0; i < node.mNumChildren; ++i)
        append(scene, *node.mChildren[i], to_world, with_normals, values, corners);
}

// Pads all lists to the current number of corners and triangles. Parts appended later do not inherit these values.
void complete(MeshFile& corners)
{
    const std::size_t n = corners.positions.size();
    if (!corners.colours.empty()) {
        corners.colours.resize(n, Vec3f::Ones());
        corners.alphas.resize(n, 1.0f);
    }
    for (auto& [name, values] : corners.values)
        std::visit([n]<class T>(std::vector<T>& list) { list.resize(n, zero<T>()); }, values);
    for (auto& [name, members] : corners.face_groups) members.resize(corners.triangles.size(), 0);
}

// Accepts regular files only. A glTF file may refer to other files, and reading from a pipe might never end.
class RegularFiles : public Assimp::DefaultIOSystem {
public:
    Assimp::IOStream* Open(const char* file, const char* mode) override
    {
        check_readable(file);
        return DefaultIOSystem::Open(file, mode);
    }
};

// Returns the glTF attributes that Assimp does not read, if its parts match those of the file.
PartValues further_values(const std::filesystem::path& path, const aiScene& scene, MeshFile& corners)
{
    PartValues values;
    const std::string extension = path.extension().string();
    if (extension.size() < 2 || std::string_view("gG").find(extension[1]) == std::string_view::npos) return values;
    GltfAttributes attributes = read_gltf_attributes(path);
    for (const std::string& what : attributes.skipped) add_skipped(corners.skipped, what);
    for (std::size_t k = 0; k < attributes.primitives.size(); ++k) {
        GltfAttributes::Primitive& primitive = attributes.primitives[k];
        const bool is_part =
            attributes.primitives.size() == scene.mNumMeshes && primitive.vertices == scene.mMeshes[k]->mNumVertices;
        for (const char* taken : {"P", "v", "id", "N", "Cd", "Alpha", "uv"})
            if (primitive.values.erase(taken) > 0)
                add_skipped(corners.skipped, fmt::format("the attribute \"_{}\"", taken));
        if (!is_part)
            for (const auto& [name, list] : primitive.values)
                add_skipped(corners.skipped, fmt::format("the attribute \"_{}\"", name));
        values.push_back(is_part ? std::move(primitive.values) : std::map<std::string, Mesh::VertexValues>());
    }
    return values;
}

[[noreturn]] void refuse(const Assimp::Importer& importer)
{
    try {
        if (const std::exception_ptr& cause = importer.GetException()) std::rethrow_exception(cause);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (...) {
    }
    throw Error(fmt::format("{}; it must be an OBJ, STL or glTF file", importer.GetErrorString()));
}

MeshFile import(const std::filesystem::path& path)
{
    check_text_end(path);
    Assimp::Importer importer;
    importer.SetIOHandler(new RegularFiles);  // owned by the importer
    const aiScene* scene = importer.ReadFile(path.string(), aiProcess_Triangulate);
    if (!scene) refuse(importer);
    MeshFile corners;
    const bool with_normals = path.extension() != ".stl" && path.extension() != ".STL";
    const PartValues values = further_values(path, *scene, corners);
    if (scene->mRootNode) append(*scene, *scene->mRootNode, aiMatrix4x4(), with_normals, values, corners);
    complete(corners);
    if (scene->mNumAnimations > 0) add_skipped(corners.skipped, "its animations");
    if (scene->mNumLights > 0) add_skipped(corners.skipped, "its lights");
    if (scene->mNumCameras > 0) add_skipped(corners.skipped, "its cameras");
    return corners;
}

RAPID_DEFINE(import_mesh, import);

}  // namespace
}  // namespace rapid
