// The shapes of pictures: of those that are other ones in each frame, two frames' surfaces are kept.
#include "bindings/host/picture_scene.h"

#include <memory>

#include "bindings/host/session.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {
namespace {

// The most surfaces that are alive at once while the pictures of so many frames are described, and how many there were.
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

}  // namespace rapid
