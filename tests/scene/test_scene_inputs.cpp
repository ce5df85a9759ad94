// The inputs of a scene's frames: everything that they depend on, and the files that they read.
#include <filesystem>

#include "bindings/scene/scene_inside.h"
#include "include/rapid/scene.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains;
using test::good;

const std::string cloud = R"(local rapid = require "rapid"
local rate = rapid.param("rate", 200, "particles born per second")
return rapid.create {} :emit { source = rapid.mesh.read "source.ply", rate = rate } :gravity {} :solve {})";

std::string triangle(double x)
{
    return "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 " +
           std::to_string(x) + " 1\n3 0 1 2\n";
}

Scene opened_to_keep(const std::filesystem::path& file, SceneOptions options = {})
{
    SceneHooks hooks;
    hooks.keep_state = true;
    return good(SceneInside::open(file, std::move(options), hooks));
}

SceneFingerprint fingerprint_of(Scene scene) { return good(SceneInside::fingerprint(scene)); }

}  // namespace

TEST_CASE("equal scenes have equal fingerprints, and others name what differs", "[inputs]")
{
    const test::TemporaryFolder folder;
    const auto file = folder.write("scene.lua", cloud);
    folder.write("source.ply", triangle(0.5));
    const SceneFingerprint first = fingerprint_of(opened_to_keep(file));
    const SceneFingerprint same = fingerprint_of(opened_to_keep(file));
    CHECK(first.parts == same.parts);
    CHECK(first.hash == same.hash);
    CHECK(first.parts.at("rate") == "200");
    CHECK(first.parts.at("emit1.rate") == "200");
    CHECK(first.parts.contains("content of source.ply"));

    SceneOptions faster;
    faster.set = {{"rate", 300.0}};
    CHECK(fingerprint_of(opened_to_keep(file, faster)).hash != first.hash);
    SceneOptions seeded;
    seeded.seed = 9;
    CHECK(fingerprint_of(opened_to_keep(file, seeded)).parts.at("seed of create1") == "9");
    folder.write("scene.lua", "-- a comment\n\n" + cloud);
    CHECK(fingerprint_of(opened_to_keep(file)).hash == first.hash);
    folder.write("source.ply", triangle(0.25));
    CHECK(fingerprint_of(opened_to_keep(file)).hash != first.hash);
}

TEST_CASE("a fingerprint is that of the parameters that the scene has now", "[inputs]")
{
    const test::TemporaryFolder folder;
    folder.write("source.ply", triangle(0.5));
    Scene scene = opened_to_keep(folder.write("scene.lua", cloud));
    const std::string before = good(SceneInside::fingerprint(scene)).hash;
    CHECK(good(SceneInside::fingerprint(scene)).hash == before);
    good(scene.set("rate", 300.0));
    CHECK(good(SceneInside::fingerprint(scene)).hash != before);
    good(scene.set("rate", 200.0));
    CHECK(good(SceneInside::fingerprint(scene)).hash == before);
}

TEST_CASE("files that frames read are reported once, and again when they change", "[inputs]")
{
    const test::TemporaryFolder folder;
    folder.write("late.ply", triangle(0.5));
    Scene scene = opened_to_keep(folder.write("scene.lua",
                                              "local rapid = require 'rapid'\n"
                                              "return rapid.create {} :emit { rate = 10, source = function(frame)\n"
                                              "if frame.number < 3 then return rapid.mesh.sphere {} end\n"
                                              "return rapid.mesh.read 'late.ply' end } :solve {}"));
    good(scene.advance_to(2));
    CHECK(good(SceneInside::take_inputs(scene)).empty());
    good(scene.advance_to(4));
    const auto inputs = good(SceneInside::take_inputs(scene));
    REQUIRE(inputs.size() == 1);
    CHECK(inputs.begin()->first == "content of late.ply");
    CHECK(good(SceneInside::take_inputs(scene)).empty());
    CHECK(good(SceneInside::are_unchanged(scene, inputs)));
    CHECK(good(SceneInside::are_unchanged(scene, {})));
    CHECK_FALSE(good(SceneInside::are_unchanged(scene, {{"late.ply", inputs.begin()->second}})));
    folder.write("late.ply", triangle(0.25));
    CHECK_FALSE(good(SceneInside::are_unchanged(scene, inputs)));
    std::filesystem::remove(folder / "late.ply");
    CHECK_FALSE(good(SceneInside::are_unchanged(scene, inputs)));
}

TEST_CASE("a scene that keeps no state has no fingerprint, and says how to get one", "[inputs]")
{
    Scene scene = test::opened("return require 'rapid'.create {} :solve {}");
    for (const SceneError& error : {SceneInside::fingerprint(scene).error(), SceneInside::take_inputs(scene).error(),
                                    SceneInside::are_unchanged(scene, {}).error()}) {
        CHECK(error.kind == SceneError::WrongCall);
        CHECK_THAT(error.message, Contains("SceneHooks::keep_state"));
    }
}

}  // namespace rapid
