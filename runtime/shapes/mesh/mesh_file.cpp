// Meshes from files, by Assimp: OBJ, STL and glTF.
//
// A mesh is its surface: normals and texture coordinates are dropped, because at a seam a vertex has several and every
// point born on the mesh would carry them. Vertex colours become Cd, and Alpha if any is not 1.
#include <assimp/DefaultIOSystem.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/Importer.hpp>
#include <string>
#include <utility>

#include "runtime/error.h"
#include "runtime/files/input_file.h"
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
        for (int k = 0; k < 3; ++k) {
            if (face.mIndices[k] >= part.mNumVertices)
                throw Error(
                    fmt::format("a face has the vertex {}; there are {}, from 0", face.mIndices[k], part.mNumVertices));
            t[k] = static_cast<std::int32_t>(first + face.mIndices[k]);
        }
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

// A glTF file names others, which are to be files as well: reading from a pipe might never end.
class RegularFiles : public Assimp::DefaultIOSystem {
public:
    Assimp::IOStream* Open(const char* file, const char* mode) override
    {
        check_readable(file);
        return DefaultIOSystem::Open(file, mode);
    }
};

MeshFile import(const std::filesystem::path& path)
{
    Assimp::Importer importer;
    importer.SetIOHandler(new RegularFiles);  // the importer's from here on
    const aiScene* scene = importer.ReadFile(path.string(), aiProcess_Triangulate);
    if (!scene) throw Error(fmt::format("{}; it must be an OBJ, STL or glTF file", importer.GetErrorString()));
    MeshFile corners;
    if (scene->mRootNode) append(*scene, *scene->mRootNode, aiMatrix4x4(), corners);
    if (!corners.colours.empty()) {
        corners.colours.resize(corners.positions.size(), Vec3f::Ones());
        corners.alphas.resize(corners.positions.size(), 1.0f);
    }
    return corners;
}

const bool defined = import_mesh.define(import);

}  // namespace
}  // namespace rapid
