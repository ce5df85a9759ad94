// Meshes that other people published (../shared/corpus): their areas, centroids, bounds and triangles as Blender has
// them, and the reason for each one that is refused.
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "runtime/shapes/mesh/mesh.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

namespace fs = std::filesystem;

const fs::path corpus = fs::path(RAPID_SOURCE_DIR).parent_path() / "shared/corpus";

// What is no mesh that can be read, and what the error says of it.
const std::map<std::string, std::string> refused = {
    {"assimp+assimp/test/models/PLY/issue623.ply", "vertex_indices = 7.941797 is not a number of its type"},
    {"assimp+assimp/test/models/glTF/BoxTextured-glTF-Binary/BoxTextured.glb", "it is binary glTF 1"},
    {"assimp+assimp/test/models/glTF/BoxTextured-glTF-MaterialsCommon/BoxTextured.gltf", "it is glTF 1.0"},
    {"assimp+assimp/test/models/glTF/BoxTextured-glTF/BoxTextured.gltf", "it is glTF 1.0"},
    {"assimp+assimp/test/models/glTF/TwoBoxes/TwoBoxes.gltf", "it is glTF 1.0"},
    {"assimp+assimp/test/models/glTF2/IncorrectVertexArrays/Cube.gltf", "a mesh has 35 indices of triangles"},
    {"assimp+assimp/test/models/glTF2/IndexOutOfRange/AllIndicesOutOfRange.gltf", "a face has the vertex 65535"},
    {"assimp+assimp/test/models/glTF2/IndexOutOfRange/IndexOutOfRange.gltf", "a face has the vertex 255"},
    {"assimp+assimp/test/models/glTF2/MissingBin/BoxTextured.gltf", "its buffer \"BoxTextured0.bin\" can't be read"},
    {"assimp+assimp/test/models/glTF2/RecursiveNodes/RecursiveNodes.gltf", "a node is below itself"},
    {"assimp+assimp/test/models/glTF2/TestNoRootNode/NoScene.gltf", "no faces"},
    {"assimp+assimp/test/models/glTF2/TestNoRootNode/SceneWithoutNodes.gltf", "no faces"},
    {"assimp+assimp/test/models/glTF2/draco/2CylinderEngine.gltf", "the extension \"KHR_draco_mesh_compression\""},
    {"assimp+assimp/test/models/glTF2/wrongTypes/badArray.gltf", "its JSON is damaged"},
    {"assimp+assimp/test/models/invalid/empty.obj", "no faces"},
    {"assimp+assimp/test/models/invalid/empty.ply", "it does not begin with \"ply\""},
    {"assimp+assimp/test/models/invalid/malformed.obj", "line 28: there is no vertex 0 of 8"},
    {"mikedh+trimesh/models/empty.obj", "no faces"},
    {"mikedh+trimesh/models/empty.ply", "no faces"},
    {"mikedh+trimesh/models/empty.stl", "no faces"},
    {"mikedh+trimesh/models/emptyIO/obj_empty.obj", "no faces"},
    {"mikedh+trimesh/models/emptyIO/obj_points.obj", "no faces"},
    {"mikedh+trimesh/models/emptyIO/ply_empty_bin.ply", "no faces"},
    {"mikedh+trimesh/models/emptyIO/ply_empty_header.ply", "no faces"},
    {"mikedh+trimesh/models/emptyIO/ply_points_ascii.ply", "no faces"},
    {"mikedh+trimesh/models/emptyIO/ply_points_bin.ply", "no faces"},
    {"mikedh+trimesh/models/emptyIO/stl_empty_ascii.stl", "no faces"},
    {"mikedh+trimesh/models/emptyIO/stl_empty_bin.stl", "no faces"},
    {"mikedh+trimesh/models/empty_nodes.glb", "no faces"},
    // Its header names fewer colours than its faces have.
    {"mikedh+trimesh/models/fuze_ascii.ply", "face 2 of 1000: vertex_indices = 0.629012 is not a number of its type"},
    {"mikedh+trimesh/models/points_emptyascii.ply", "no faces"},
};

// Its pentagon is not flat: its area depends on how it is cut, which no specification says.
constexpr const char* ambiguous = "mikedh+trimesh/models/polygonfaces.obj";

std::vector<fs::path> meshes()
{
    static const std::set<std::string> extensions = {".obj", ".ply", ".stl", ".gltf", ".glb"};
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(corpus)) {
        std::string extension = entry.path().extension();
        for (char& c : extension) c = static_cast<char>(std::tolower(c));
        if (extensions.count(extension) > 0) files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

Vec3d centroid(const Mesh& mesh)
{
    Vec3d sum = Vec3d::Zero();
    double area = 0;
    for (const Mesh::Triangle& t : mesh.triangles) {
        const Vec3d a = mesh.positions[t[0]].cast<double>(), b = mesh.positions[t[1]].cast<double>(),
                    c = mesh.positions[t[2]].cast<double>();
        const double twice = (b - a).cross(c - a).norm();
        sum += twice * (a + b + c) / 3;
        area += twice;
    }
    return sum / area;
}

Vec3d vector(const nlohmann::json& numbers)
{
    return Vec3d(numbers.at(0).get<double>(), numbers.at(1).get<double>(), numbers.at(2).get<double>());
}

}  // namespace

TEST_CASE("published meshes have the area, centroid and bounds that Blender finds, or are refused with a reason",
          "[mesh][corpus]")
{
    if (!fs::exists(corpus)) {
        WARN("left out: there is no " << corpus);
        return;
    }
    std::ifstream text(corpus / "expected.json");
    const nlohmann::json expected = nlohmann::json::parse(text);
    for (const fs::path& path : meshes()) {
        const std::string name = fs::relative(path, corpus).string();
        CAPTURE(name);
        MeshPtr mesh;
        const std::string error = error_of([&] { mesh = read_mesh(path); });
        if (const auto reason = refused.find(name); reason != refused.end()) {
            CHECK_THAT(error, Catch::Contains(reason->second));
            continue;
        }
        CHECK(error == "");
        if (!mesh || !expected.contains(name) || name == ambiguous) continue;
        const nlohmann::json& of_blender = expected.at(name);
        const double area = of_blender.at("area"),
                     size = (vector(of_blender.at("high")) - vector(of_blender.at("low"))).norm();
        CHECK(mesh->area() == Approx(area).epsilon(1e-4).margin(1e-4 * size * size));
        CHECK_THAT(centroid(*mesh), close_to(vector(of_blender.at("centroid")), 1e-3 * size));
        CHECK_THAT(mesh->bounds().min().cast<double>().eval(), close_to(vector(of_blender.at("low")), 1e-4 * size));
        CHECK_THAT(mesh->bounds().max().cast<double>().eval(), close_to(vector(of_blender.at("high")), 1e-4 * size));
    }
}
