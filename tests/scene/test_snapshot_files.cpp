// Snapshots in files: bit-identical to those in memory, for any later scene of the same graph; files that are not
// snapshots.
#include <cstring>
#include <fstream>

#include "bindings/scene/scene_inside.h"
#include "include/rapid/scene.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains, Catch::StartsWith;
using test::good;

const std::string cloud = R"(
local rapid = require "rapid"
local rate = rapid.param("rate", 2000, "particles born per second")
return rapid.create { fps = 24, seed = 3 }
  :emit { source = rapid.mesh.sphere { radius = 1, center = {0, 2, 0} }, rate = rate, birth = "random",
          life = {0.1, 0.6}, speed = 1, spread = 30, attributes = { heat = 1, name = "ember" } }
  :gravity {} :collide { shape = rapid.shape.plane {}, bounce = 0.4 } :contact { radius = 0.02 }
  :solve { substeps = 2 }
)";

Scene opened(const std::string& text = cloud) { return test::opened(text); }

}  // namespace

TEST_CASE("a run continued from a snapshot file is bit-identical to the uninterrupted run", "[snapshots]")
{
    const test::TemporaryFolder folder;
    const std::string file = folder / "deep/cloud.state";
    Scene scene = opened();
    good(scene.advance_to(8));
    {
        const SceneSnapshot snapshot = good(scene.save());
        good(snapshot.write(file));
        CHECK(SceneInside::is_snapshot(file));
    }
    const SceneFrame expected = good(scene.advance_to(14));
    REQUIRE(expected.size() > 100);

    const SceneSnapshot read = good(SceneSnapshot::read(file));
    CHECK(read.frame() == 8);
    Scene later = opened();
    good(later.restore(read));
    CHECK(later.next_frame() == 9);
    const SceneFrame frame = good(later.advance_to(14));
    CHECK(good(frame.compare(expected, 0)).same);
    const SceneColumn P = *frame.column("P"), of_run = *expected.column("P");
    REQUIRE(P.count == of_run.count);
    for (std::size_t i = 0; i < P.count; ++i) REQUIRE(std::memcmp(P.at<float>(i), of_run.at<float>(i), 12) == 0);
}

TEST_CASE("a file of a snapshot is described", "[snapshots]")
{
    const test::TemporaryFolder folder;
    const std::string file = folder / "cloud.state";
    Scene scene = opened();
    good(scene.advance_to(3));
    good(good(scene.save()).write(file));
    const SceneReport report = good(SceneInside::describe_snapshot(file));
    CHECK_THAT(report.json, StartsWith(R"({"what":"snapshot of a scene","graph":"cloud.lua","frame":3,)"));
    CHECK_THAT(report.json, Contains(R"("simulations":{"create1":)"));
    CHECK_THAT(report.text, StartsWith(file + ": a snapshot, ") && Contains("of cloud.lua after frame 3\n"));
}

TEST_CASE("a snapshot to another graph is refused, from a file too", "[snapshots]")
{
    const test::TemporaryFolder folder;
    Scene scene = opened();
    good(scene.advance_to(2));
    good(good(scene.save()).write(folder / "cloud.state"));
    const SceneSnapshot read = good(SceneSnapshot::read(folder / "cloud.state"));
    Scene other = opened("local rapid = require 'rapid'\nreturn rapid.create {} :gravity {} :solve {}");
    const Result<Done> restored = other.restore(read);
    REQUIRE_FALSE(restored);
    CHECK(restored.error().kind == SceneError::WrongCall);
    CHECK_THAT(restored.error().message, Contains("to another graph"));
    CHECK(good(other.advance()).number() == 1);
}

TEST_CASE("a file that is no snapshot, torn or damaged is an error that names it", "[snapshots]")
{
    const test::TemporaryFolder folder;
    Scene scene = opened();
    good(scene.advance_to(2));
    const std::string file = folder / "cloud.state";
    good(good(scene.save()).write(file));
    const std::string whole = test::file_text(file);
    const auto refused = [&](const std::string& path) {
        const Result<SceneSnapshot> read = SceneSnapshot::read(path);
        REQUIRE_FALSE(read);
        CHECK(read.error().kind == SceneError::WrongCall);
        CHECK(read.error().file == path);
        CHECK_FALSE(SceneInside::describe_snapshot(path));
    };
    refused(folder / "nothing.state");
    refused(folder.path());
    refused(folder.write("text.state", "no snapshot"));
    for (std::size_t end = 0; end < whole.size(); end += 1 + whole.size() / 40)
        refused(folder.write("torn.state", whole.substr(0, end)));
    for (std::size_t place = 0; place < whole.size(); place += 1 + whole.size() / 40) {
        std::string damaged = whole;
        damaged[place] = static_cast<char>(damaged[place] ^ 1);
        refused(folder.write("damaged.state", damaged));
    }
    CHECK_FALSE(SceneInside::is_snapshot(folder / "text.state"));
    CHECK_FALSE(SceneInside::is_snapshot(folder / "nothing.state"));
    CHECK_FALSE(good(scene.save()).write("/dev/null/cloud.state"));
}

}  // namespace rapid
