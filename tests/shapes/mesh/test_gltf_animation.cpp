// Meshes that an animation of a glTF file moves, at the frames of a scene.
#include "runtime/shapes/mesh/gltf_animation.h"

#include <fmt/format.h>

#include "runtime/shapes/mesh/detailed_mesh.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;
using Catch::Matchers::Contains;

namespace {

// Two triangles that coincide along an edge; "part" moves the second one by 4 m along x from 0 s to 2 s.
class Parting {
public:
    Parting()
    {
        const float buffer[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 4, 0, 0};
        folder_.write("a.bin", std::string(reinterpret_cast<const char*>(buffer), sizeof buffer));
        folder_.write(
            "a.gltf",
            R"({"asset":{"version":"2.0"},"buffers":[{"uri":"a.bin","byteLength":68}],"bufferViews":[{"buffer":0}],)"
            R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":3},)"
            R"({"bufferView":0,"byteOffset":36,"componentType":5126,"type":"SCALAR","count":2},)"
            R"({"bufferView":0,"byteOffset":44,"componentType":5126,"type":"VEC3","count":2}],)"
            R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0},{"mesh":0}],)"
            R"("animations":[{"name":"part","samplers":[{"input":1,"output":2}],)"
            R"("channels":[{"sampler":0,"target":{"node":1,"path":"translation"}}]}]})");
    }
    const TemporaryFolder& folder() const { return folder_; }
    GltfAnimatedMesh read(const std::string& name, double speed = 1, FrameSequence order = {}) const
    {
        return {folder_ / "a.gltf", name, speed, order};
    }

private:
    TemporaryFolder folder_;
};

}  // namespace

TEST_CASE("an animation is at its time of the scene, at any speed and offset, and holds, repeats or turns round",
          "[mesh][gltf]")
{
    const Parting file;
    const FrameClock clock{.fps = 10, .start = 1};
    const auto apart = [&](const GltfAnimatedMesh& mesh, std::int64_t frame) {
        return mesh.at(clock, frame)->bounds().max().x() - 1;
    };
    const GltfAnimatedMesh plain = file.read("part");
    CHECK(apart(plain, 1) == 0);
    CHECK(apart(plain, 6) == 1);
    CHECK(apart(plain, 21) == 4);
    CHECK(apart(plain, 100) == 4);
    CHECK(apart(plain, -5) == 0);
    CHECK(apart(file.read("", 2), 6) == 2);
    CHECK(apart(file.read("part", 1, {.offset = 5}), 6) == 0);
    const GltfAnimatedMesh repeated =
        file.read("part", 1, {.before = FrameSequence::Repeat, .after = FrameSequence::Mirror});
    CHECK(apart(repeated, 26) == Approx(3));
    CHECK(apart(repeated, -4) == Approx(3));
}

TEST_CASE("corners that coincide at rest and part in an animation are vertices of their own", "[mesh][gltf]")
{
    const Parting file;
    const GltfAnimatedMesh mesh = file.read("part");
    CHECK(mesh.rest()->positions.size() == 6);
    CHECK(mesh.rest()->triangles.size() == 2);
    CHECK(mesh.rest()->area() == 1);
}

TEST_CASE("corners share a vertex only if they move alike, however short the movement", "[mesh][gltf]")
{
    // Two triangles of one mesh share two places. The morph target moves the second triangle by 1 m along z, with the
    // weights 0, 1, 0, 1, ..., 0 at 17 keys in 4 s, so that they meet at each eighth of it.
    std::vector<float> buffer = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    for (int i = 0; i < 6; ++i) buffer.insert(buffer.end(), {0, 0, i < 3 ? 0.0f : 1.0f});
    for (int k = 0; k < 17; ++k) buffer.push_back(static_cast<float>(k) / 4);
    for (int k = 0; k < 17; ++k) buffer.push_back(static_cast<float>(k % 2));
    const TemporaryFolder folder;
    folder.write("a.bin", std::string(reinterpret_cast<const char*>(buffer.data()), buffer.size() * sizeof(float)));
    const auto vertices = [&](const std::string& target) {
        const auto path = folder.write(
            "a.gltf", R"({"buffers":[{"uri":"a.bin"}],"bufferViews":[{"buffer":0}],"accessors":[)"
                      R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":6},)"
                      R"({"bufferView":0,"byteOffset":72,"componentType":5126,"type":"VEC3","count":6},)"
                      R"({"bufferView":0,"byteOffset":144,"componentType":5126,"type":"SCALAR","count":17},)"
                      R"({"bufferView":0,"byteOffset":212,"componentType":5126,"type":"SCALAR","count":17}],)"
                      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"targets":[)" +
                          target +
                          R"(]}]}],"nodes":[{"mesh":0}],"animations":[{"samplers":[{"input":2,"output":3}],)"
                          R"("channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}]}]})");
        return GltfAnimatedMesh(path, "", 1, {}).rest()->positions.size();
    };
    CHECK(vertices(R"({"POSITION":1})") == 6);
    CHECK(vertices("{}") == 4);
}

TEST_CASE("corners with the same joints and weights share a vertex, and others do not", "[mesh][gltf]")
{
    GltfPrimitive primitive;
    primitive.positions.assign(4, Vec3f(1, 2, 3));
    primitive.joints = {{0, 1, 0, 0}, {0, 1, 5, 0}, {0, 2, 0, 0}, {0, 1, 0, 0}};
    primitive.weights = {{0.5f, 0.5f, 0, 0}, {0.5f, 0.5f, 0, 0}, {0.5f, 0.5f, 0, 0}, {0.25f, 0.75f, 0, 0}};
    GltfFile file;
    file.meshes.resize(1);
    file.meshes[0].primitives = {primitive};
    file.nodes.resize(1);
    file.nodes[0].mesh = file.nodes[0].skin = 0;
    file.shown = {0};
    CHECK(join_moved_alike(file) == std::vector<std::int32_t>{0, 0, 1, 2});
    file.nodes[0].skin.reset();
    CHECK(join_moved_alike(file) == std::vector<std::int32_t>{0, 0, 0, 0});
    file.nodes[0].instances.assign(2, Eigen::Affine3d::Identity());
    CHECK(join_moved_alike(file) == std::vector<std::int32_t>{0, 0, 0, 0, 1, 1, 1, 1});
}

TEST_CASE("an animated file may be compressed and its extension in capitals, and errors name the file", "[mesh][gltf]")
{
    const Parting file;
    const auto named = [&](const char* name) {
        std::filesystem::copy_file(file.folder() / "a.gltf", file.folder() / name);
        return GltfAnimatedMesh(file.folder() / name, "part", 1, {}).rest()->positions.size();
    };
    CHECK(named("A.GLTF") == 6);
    CHECK(named("b.glb.gz") == 6);
    CHECK_THAT(error_of([&] { named("a.obj"); }),
               Contains("a.obj\": animation is for .gltf and .glb, and it is neither"));
    CHECK_THAT(error_of([&] { GltfAnimatedMesh(file.folder().write("c.gltf", "{"), "", 1, {}); }),
               Contains("cannot read the mesh \"") && Contains("c.gltf\": its JSON is damaged"));
}

TEST_CASE("the animation of a node with a matrix is reported", "[mesh][gltf]")
{
    const Parting file;
    std::string text = file_text(file.folder() / "a.gltf");
    text.replace(text.rfind(R"({"mesh":0}])"), 10, R"({"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1]})");
    const GltfAnimatedMesh mesh(file.folder().write("b.gltf", text), "", 1, {});
    const auto& detailed = dynamic_cast<const DetailedMesh&>(*mesh.rest());
    REQUIRE(detailed.skipped.size() == 1);
    CHECK_THAT(detailed.skipped[0], Contains("the animation of node 1, which has a matrix"));
    CHECK(mesh.at({.fps = 10, .start = 1}, 21)->bounds().max().x() == 6);
}

TEST_CASE("an animation that a file lacks is refused with those that it has", "[mesh][gltf]")
{
    const Parting file;
    CHECK_THAT(error_of([&] { file.read("pat"); }),
               Contains("there is no animation \"pat\"; the file has \"part\"") && Contains("did you mean \"part\"?"));
    CHECK_THAT(error_of([&] { file.read("part", 1, {.before = FrameSequence::None}); }), Contains("\"hold\""));
}
