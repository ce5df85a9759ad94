// The lines on the ground.
#include "runtime/picture/ground.h"

#include "runtime/picture/picture.h"
#include "runtime/picture/picture_fit.h"
#include "tests/test.h"

using namespace rapid;

namespace {

PointSet point_at(const Vec3f& P)
{
    PointSet points;
    points.append(1);
    points.P().write()[0] = P;
    return points;
}

FrameInfo frame_of(const PictureOptions& options, const PictureScene& scene)
{
    FrameInfo frame;
    frame.picture = std::make_shared<PictureOptions>(options);
    frame.scene = std::make_shared<PictureScene>(scene);
    return frame;
}

}  // namespace

TEST_CASE("under a given camera the ground stays as it is, wherever points go", "[picture]")
{
    PictureOptions options{.width = 320, .height = 200};
    PictureScene scene;
    const bool is_of_scene = GENERATE(false, true);
    (is_of_scene ? scene.camera.position : options.position) = Vec3d(0, 1.8, 6.5);
    (is_of_scene ? scene.camera.target : options.target) = Vec3d(0, 1.5, 0);
    const FrameInfo frame = frame_of(options, scene);
    // Without points, the picture shows only the ground and the backdrop.
    const auto ground = [&](const PictureView& view) { return render({}, options, scene, view).rgb; };

    PictureFit fit;
    const auto first = ground(fit.next(point_at({0, 0.5, 0}), frame));
    const auto later = ground(fit.next(point_at({30, 30, -30}), frame));
    CHECK(first == later);
    CHECK(first == ground(PictureFit().next(point_at({-5, 8, 2}), frame)));

    scene.grid = false;
    CHECK(first != ground(fit.next(point_at({30, 30, -30}), frame)));
}

TEST_CASE("a scene without lines has the picture of options without lines", "[picture]")
{
    PictureOptions options{.width = 320, .height = 200};
    PictureScene scene;
    const PictureView view = PictureFit().next(point_at({0, 0.5, 0}), frame_of(options, scene));
    const auto with = render({}, options, scene, view).rgb;
    scene.grid = false;
    const auto without = render({}, options, scene, view).rgb;
    scene.grid = true;
    options.grid = false;
    CHECK(without == render({}, options, scene, view).rgb);
    CHECK(without != with);
}
