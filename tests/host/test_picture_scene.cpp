// The shapes of pictures: if a surface is a new one in each frame, those of two frames are kept.
#include "bindings/host/picture_scene.h"

#include <memory>
#include <tuple>

#include "bindings/host/session.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {
namespace {

std::shared_ptr<const PictureScene> described(const std::string& scene, std::int64_t frame)
{
    const test::TemporaryFolder folder;
    const Session session(folder.write("scene.lua", "local rapid = require 'rapid'\nreturn " + scene), {});
    const Plan plan(session.graph(), PlanOptions{});
    return SceneOfPlan(plan).at(frame);
}

// Describes the pictures of this many frames. Returns the maximum number of surfaces alive at once, and the number
// created.
std::pair<std::size_t, std::size_t> surfaces(const std::string& shape, std::int64_t frames)
{
    const test::TemporaryFolder folder;
    const Session session(
        folder.write("scene.lua",
                     "local rapid = require 'rapid'\nlocal ball = rapid.levelset.sphere { voxel = 0.2 }\n"
                     "return rapid.create {} :collide { shape = function(frame) return " +
                         shape + " end } :solve {}"),
        {});
    const Plan plan(session.graph(), PlanOptions{});
    SceneOfPlan scenes(plan);
    std::vector<std::weak_ptr<const Mesh>> alive;
    std::size_t most = 0, all = 0;
    for (std::int64_t frame = 1; frame <= frames; ++frame) {
        const auto scene = scenes.at(frame);
        REQUIRE(scene->bodies.size() == 1);
        std::erase_if(alive, [](const auto& mesh) { return mesh.expired(); });
        const auto is_this = [&](const auto& mesh) { return mesh.lock() == scene->bodies[0].mesh; };
        if (std::none_of(alive.begin(), alive.end(), is_this)) {
            alive.push_back(scene->bodies[0].mesh);
            ++all;
        }
        most = std::max(most, alive.size());
    }
    return {most, all};
}

}  // namespace

TEST_CASE("of surfaces that are other ones in each frame those of two frames are kept", "[picture]")
{
    const auto [most, all] = surfaces("rapid.shape.sphere { radius = 1 + 0.001 * frame.number }", 500);
    CHECK(most == 2);
    CHECK(all == 500);
}

TEST_CASE("of surfaces of level sets, which keep their own, there are as many as level sets that are alive",
          "[picture]")
{
    const std::string ball = "rapid.levelset.sphere { radius = 1 + 0.001 * frame.number, voxel = 0.3 }";
    const auto [most_of_few, few] = surfaces(ball, 50);
    const auto [most, all] = surfaces(ball, 500);
    CHECK(few == 50);
    CHECK(all == 500);
    CHECK(most == most_of_few);
    CHECK(most < 12);
}

TEST_CASE("a level set that stays has one surface for all frames", "[picture]")
{
    CHECK(surfaces("ball", 100) == std::pair<std::size_t, std::size_t>(1, 1));
}

TEST_CASE("a collider is a vessel in all frames if it encloses a source where the scene begins", "[picture]")
{
    const std::string chain =
        " :collide { shape = rapid.levelset.box { size = {1, 1, 1}, voxel = 0.05 }, name = 'box', transform = "
        "function(frame) return rapid.translate(0.5 * (frame.number - 3), 0, 0) end } :solve {}";
    const auto is_vessel = [&](const std::string& source, std::int64_t frame) {
        const auto scene = described(source + chain, frame);
        const PictureScene::Body& last = scene->bodies.back();
        REQUIRE(last.role == PictureScene::Body::Collider);
        return last.is_vessel;
    };
    const auto source_at = [](const char* x) {
        return "rapid.create { start = 3 } :emit { rate = 9, source = rapid.mesh.sphere { radius = 0.2, center = {" +
               std::string(x) + ", 0, 0} } }";
    };
    const auto points_at = [](const char* x) {
        return "rapid.create { start = 3, points = rapid.points.from { P = {{0, 0, 0}, {" + std::string(x) +
               ", 0, 0}} } }";
    };
    const std::int64_t frame = GENERATE(3, 4, 20);
    CAPTURE(frame);
    CHECK(is_vessel(source_at("0.1"), frame));
    CHECK_FALSE(is_vessel(source_at("0.4"), frame));  // only half of it is inside
    CHECK_FALSE(is_vessel(source_at("5"), frame));
    CHECK(is_vessel(points_at("0.4"), frame));
    CHECK_FALSE(is_vessel(points_at("0.6"), frame));
    // A source of points, and a collider, are not vessels.
    CHECK_FALSE(
        is_vessel("rapid.create { start = 3 } :emit { rate = 9, source = rapid.levelset.box { size = {1, 1, 1}, "
                  "voxel = 0.05 } }",
                  frame));
}

TEST_CASE("a second :picture changes only what it names", "[picture]")
{
    const std::string first =
        "rapid.create {} :emit { rate = 9, source = rapid.mesh.box {} } :gravity {} :solve {} "
        ":picture { blend = 'add', shutter = 0.5, emitters = false, camera = rapid.camera { position = {0, 1, 4} } }";
    const auto look = [&](const std::string& later) {
        const auto scene = described(first + later, 1);
        bool additive = false;
        double shutter = 0;
        for (const PointStyle& style : scene->styles) {
            additive = style.additive.value_or(additive);
            shutter = style.shutter.value_or(shutter);
        }
        return std::tuple(additive, shutter * 24, scene->camera.position.value().z(), scene->bodies.size());
    };
    CHECK(look("") == std::tuple(true, 0.5, 4.0, 0));
    CHECK(look(":picture {}") == look(""));
    CHECK(look(":picture { blend = 'over' }") == std::tuple(false, 0.5, 4.0, 0));
    CHECK(look(":picture { shutter = 0 }") == std::tuple(true, 0.0, 4.0, 0));
    CHECK(look(":picture { emitters = true }") == std::tuple(true, 0.5, 4.0, 1));
    CHECK(look(":picture { colliders = false }") == look(""));
    CHECK(look(":picture { camera = rapid.camera { position = {0, 1, 9} } }") == std::tuple(true, 0.5, 9.0, 0));
}

}  // namespace rapid
