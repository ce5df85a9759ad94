// The scenes of docs/guide.md run as they are printed there.
#include "bindings/host/session.h"
#include "runtime/graph/evaluate.h"
#include "tests/docs/document.h"
#include "tests/files/temporary_folder.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

// A box on the ground replaces the reader's model.
const char* const box =
    "v -1 0 -1\nv 1 0 -1\nv 1 1 -1\nv -1 1 -1\nv -1 0 1\nv 1 0 1\nv 1 1 1\nv -1 1 1\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";

}  // namespace

TEST_CASE("each scene of the guide emits points and names its camera", "[docs]")
{
    const std::string text = test::read_text(test::project / "docs/guide.md");
    const auto scenes = test::matches(text, std::regex(R"re(\n```lua (\w+\.lua)\n([^`]*)```)re"));
    REQUIRE(scenes.size() == 6);
    for (const auto& scene : scenes) {
        CAPTURE(scene[1]);
        const test::TemporaryFolder folder;
        folder.write("statue.obj", box);
        const fs::path file = folder.write(scene[1], scene[2]);
        const Session session(file, {});
        const Plan plan(session.graph(), {});
        Evaluator evaluator(plan);
        PointSet points;
        for (int frame = 1; frame <= 12; ++frame) points = evaluator.advance().outputs.at("main");
        CHECK(points.size() > 100);
        CHECK(std::string(scene[2]).find("rapid.camera") != std::string::npos);
    }
}

}  // namespace rapid
