// Meshes that an animation of a glTF file moves, at the frames of a scene.
#include "runtime/shapes/mesh/gltf_animation.h"

#include <fmt/format.h>

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

TEST_CASE("an animation that a file lacks is refused with those that it has", "[mesh][gltf]")
{
    const Parting file;
    CHECK_THAT(error_of([&] { file.read("pat"); }),
               Contains("there is no animation \"pat\"; the file has \"part\"") && Contains("did you mean \"part\"?"));
    CHECK_THAT(error_of([&] { file.read("part", 1, {.before = FrameSequence::None}); }), Contains("\"hold\""));
}
