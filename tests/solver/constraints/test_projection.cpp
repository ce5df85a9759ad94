// The joint projection of all constraints of a substep.
#include <string>

#include "runtime/base/error.h"
#include "tests/solver/constraints/granular.h"

namespace rapid {
namespace {

using test::Granular;
using test::points;

std::string projection_error(Granular& scene)
{
    try {
        scene.run(1);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

TEST_CASE("points that become infinite within a frame stop it before neighbours are looked for", "[projection]")
{
    const double huge = GENERATE(1e60, 1e200, 1e300);
    Granular scene(points({{0, 0, 0}, {0.3f, 0, 0}, {5, 0, 0}}).set<float>("pscale", {0.2f, 0.2f, 0.2f}));
    scene.force([huge](const Chunk& chunk, std::size_t i) { return Vec3d(chunk.P[i].x() > 1 ? huge : 0, 0, 0); });
    scene.substeps(8);
    CHECK(projection_error(scene) ==
          "point 2, frame 1: P became {inf, 0, 0} in a substep; the frame was not written; use weaker forces or more "
          "substeps; it had P = {5, 0, 0}, v = {0, 0, 0}, pscale = 0.2");
}

}  // namespace
}  // namespace rapid
