// Checks the memory of the static part of a picture.
#include "runtime/picture/picture.h"
#include "runtime/picture/picture_fit.h"
#include "runtime/picture/surfaces.h"
#include "tests/test.h"

// The lines on the ground.
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

namespace rapid {
namespace {

// Returns a view from 10 m in front of the origin, slightly above.
PictureView view_from_above()
{
    PictureView view;
    view.camera = {Vec3d(0, 4, 10), Vec3d::Zero(), 1.2};
    view.bounds = Box3d(Vec3d(-3, -3, -3), Vec3d(3, 3, 3));
    view.line_spacing = 1;
    return view;
}

double allocated(const std::vector<SurfaceTile>& tiles)
{
    std::size_t bytes = 0;
    for (const SurfaceTile& tile : tiles)
        bytes += sizeof tile.colour[0] * tile.colour.capacity() + tile.bytes.capacity() +
                 sizeof(float) * tile.depth.capacity() + sizeof(SurfaceTile::Lit) * tile.lit.capacity();
    return static_cast<double>(bytes);
}

double bytes_per_pixel(const PictureScene& scene)
{
    const PictureOptions options{.width = 20 * tile_size, .height = 15 * tile_size};
    const PictureView view = view_from_above();
    return allocated(draw_surfaces(options, scene, view, Light(scene, view))) / (options.width * options.height);
}

PictureScene with_block()
{
    auto mesh = std::make_shared<Mesh>();
    mesh->positions = {{-1, 1, -1}, {-1, 1, 1}, {1, 1, 1}, {1, 1, -1}};
    mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
    PictureScene scene;
    scene.planes.push_back({Vec3d(0, 1, 0), 0});
    scene.bodies.push_back({mesh, PictureScene::Body::Collider});
    return scene;
}

TEST_CASE("the surfaces of a picture take no more than is reckoned with", "[picture][surfaces]")
{
    CHECK(bytes_per_pixel({}) == Approx(surface_bytes_per_pixel(false)));  // the ground grid takes no shadows of points

    PictureScene walls;  // fill the whole picture
    walls.planes.push_back({Vec3d(0, 1, 0), 0});
    walls.planes.push_back({Vec3d(0, 0, 1), -20});
    CHECK(bytes_per_pixel(walls) == Approx(surface_bytes_per_pixel(true)));

    CHECK(bytes_per_pixel(with_block()) < surface_bytes_per_pixel(true));
}

}  // namespace

}  // namespace rapid
