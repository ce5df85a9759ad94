#include "runtime/picture/picture.h"

#include <tbb/global_control.h>

#include <cmath>

#include "runtime/io/format.h"
#include "runtime/picture/picture_fit.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

// From 10 m in front of the origin, 90° high: a metre at the origin is height / 20 pixels.
PictureView front_view()
{
    PictureView view;
    view.camera = {Vec3d(0, 0, 10), Vec3d::Zero(), std::acos(0.0)};
    view.bounds = Box3d(Vec3d(-10, -10, -10), Vec3d(10, 10, 10));
    return view;
}

const PictureOptions small{.width = 320, .height = 200, .grid = false};

PointSet balls(const std::vector<Vec3f>& at, const std::vector<Vec3f>& colours, float radius)
{
    PointSet points;
    points.append(at.size());
    points.add({"Cd", Vec3f(0, 0, 0)});
    points.add({"pscale", radius});
    for (std::size_t i = 0; i < at.size(); ++i) {
        points.P().write()[i] = at[i];
        points.id().write()[i] = static_cast<std::int64_t>(i);
        points.column<Vec3f>("Cd").write()[i] = colours[i];
    }
    return points;
}

const Vec3f red(1, 0, 0), green(0, 1, 0);

bool is_red(const std::uint8_t* pixel) { return pixel[0] > 100 && pixel[1] < 40; }
bool is_green(const std::uint8_t* pixel) { return pixel[1] > 100 && pixel[0] < 40; }
bool is_background(const std::uint8_t* pixel) { return pixel[0] < 60 && pixel[1] < 60 && pixel[2] < 60; }

PictureScene::Body quad(float z, PictureScene::Body::Role role = PictureScene::Body::Collider)
{
    auto mesh = std::make_shared<Mesh>();
    mesh->positions = {{-2, -2, z}, {2, -2, z}, {2, 2, z}, {-2, 2, z}};
    mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
    return {mesh, role};
}

}  // namespace

TEST_CASE("the camera projects a point to the pixel that trigonometry gives", "[io][picture]")
{
    const Camera camera = front_view().camera;
    CHECK_THAT(camera.project({0, 0, 0}, 320, 200), close_to(Vec3d(160, 100, 10), 1e-4));
    CHECK_THAT(camera.project({1, 2, 0}, 320, 200), close_to(Vec3d(170, 80, 10), 1e-4));
    CHECK_THAT(camera.project({1, 0, 5}, 320, 200), close_to(Vec3d(180, 100, 5), 1e-4));
    CHECK(camera.project({0, 0, 11}, 320, 200).z() < 0);

    const Camera above{Vec3d(0, 4, 0), Vec3d::Zero(), 1.0};  // straight down, where up is not up
    CHECK_THAT(above.project({0, 0, 0}, 320, 200), close_to(Vec3d(160, 100, 4), 1e-4));
}

TEST_CASE("a point is drawn as a disc of its radius, where the camera projects it", "[io][picture]")
{
    const PointSet points = balls({{1, 2, 0}}, {red}, 0.5f);  // 5 pixels about 170, 80

    const Picture picture = render(points, small, {}, front_view());

    CHECK(is_red(picture.pixel(170, 80)));
    CHECK(is_red(picture.pixel(166, 80)));
    CHECK(is_red(picture.pixel(173, 80)));
    CHECK(is_background(picture.pixel(164, 80)));
    CHECK(is_background(picture.pixel(175, 80)));
    CHECK(is_background(picture.pixel(150, 120)));
    // Its edge is smooth: the light over all of it is that of its area, to a few per cent.
    double covered = 0;
    for (int y = 70; y < 90; ++y)
        for (int x = 160; x < 180; ++x) covered += picture.pixel(x, y)[0] > 40;
    CHECK(covered == Approx(3.14159 * 25).epsilon(0.25));
}

TEST_CASE("a nearer point hides a farther one, whatever their order in the set", "[io][picture]")
{
    const bool swapped = GENERATE(false, true);
    const Vec3f near(0, 0, 1), far(0, 0, -1);
    const PointSet points = swapped ? balls({far, near}, {green, red}, 0.5f) : balls({near, far}, {red, green}, 0.5f);

    CHECK(is_red(render(points, small, {}, front_view()).pixel(160, 100)));
}

TEST_CASE("a collider hides the points behind it and not those before it", "[io][picture]")
{
    PictureScene scene;
    scene.bodies.push_back(quad(0));
    const PointSet points = balls({{-1, 0, 1}, {1, 0, -1}}, {red, green}, 0.3f);
    const Camera camera = front_view().camera;
    const auto pixel = [&](const Picture& picture, const Vec3d& P) {
        const Vec3d s = camera.project(P, small.width, small.height);
        return picture.pixel(static_cast<int>(s.x()), static_cast<int>(s.y()));
    };

    const Picture hidden = render(points, small, scene, front_view());
    CHECK(is_red(pixel(hidden, {-1, 0, 1})));
    CHECK_FALSE(is_green(pixel(hidden, {1, 0, -1})));
    CHECK_FALSE(is_background(pixel(hidden, {1.5, 1.5, 0})));  // the collider itself is seen

    scene.bodies[0].role = PictureScene::Body::Emitter;
    CHECK(is_green(pixel(render(points, small, scene, front_view()), {1, 0, -1})));
}

TEST_CASE("a vessel does not hide the points in it", "[io][picture]")
{
    PictureScene scene;
    scene.bodies.push_back({make_box({4, 4, 4}, {0, 0, 0})});
    const PointSet points = balls({{0, 0, 0}, {0.1f, 0, 0}}, {red, red}, 0.3f);

    CHECK(is_red(render(points, small, scene, front_view()).pixel(160, 100)));
}

TEST_CASE("a plane of the scene hides the points under it", "[io][picture]")
{
    PictureScene scene;
    scene.planes.push_back({Vec3d(0, 2, 0), -2});  // y = -1
    PictureView view = front_view();
    view.camera.position = Vec3d(0, 5, 10);
    const PointSet points = balls({{-2, -0.5f, 0}, {2, -2, 0}}, {red, green}, 0.3f);
    const Picture picture = render(points, small, scene, view);
    const auto at = [&](const Vec3d& P) {
        const Vec3d s = view.camera.project(P, small.width, small.height);
        return picture.pixel(static_cast<int>(s.x()), static_cast<int>(s.y()));
    };

    CHECK(is_red(at({-2, -0.5, 0})));
    CHECK_FALSE(is_green(at({2, -2, 0})));
}

TEST_CASE("a wall between the camera and the scene is transparent, and one behind it is drawn", "[io][picture]")
{
    const PointSet points = balls({{0, 0, 0}}, {red}, 0.3f);
    const auto seen = [&](const std::vector<PictureScene::Plane>& planes) {
        PictureScene scene;
        scene.planes = planes;
        return render(points, small, scene, front_view());
    };
    const Picture open = seen({});
    CHECK(seen({{Vec3d(0, 0, -1), -3}}).rgb == open.rgb);  // free below z = 3; the camera is above
    const Picture behind = seen({{Vec3d(0, 0, 1), -3}});   // free above z = -3
    CHECK(is_red(behind.pixel(160, 100)));
    CHECK(behind.rgb != open.rgb);
}

TEST_CASE("points without colour are coloured by speed, faster ones lighter", "[io][picture]")
{
    PointSet points;
    points.append(3);
    points.add({"pscale", 0.5f});
    for (int i = 0; i < 3; ++i) {
        points.P().write()[i] = Vec3f(static_cast<float>(3 * i - 3), 0, 0);
        points.v().write()[i] = Vec3f(0, 0.5f * static_cast<float>(i), 0);
    }
    const Picture picture = render(points, small, {}, front_view());
    const auto light = [&](int x) { return picture.pixel(x, 100)[0] + picture.pixel(x, 100)[1]; };
    CHECK(light(130) + 20 < light(160));
    CHECK(light(160) + 20 < light(190));
}

TEST_CASE("a picture has the same bits on any number of threads", "[io][picture][threads]")
{
    PictureScene scene;
    scene.bodies.push_back({make_torus(1, 0.3, 24, {0, 0, 0})});
    scene.planes.push_back({Vec3d::UnitY(), -1});
    const PointSet points = random_points({.size = 30000});
    PictureFit fit;
    const FrameInfo frame{.scene = std::make_shared<PictureScene>(scene)};
    const PictureView view = fit.next(points, frame);
    std::vector<std::uint8_t> first;
    for (const int threads : {1, 2, 7}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const Picture picture = render(points, small, scene, view);
        if (first.empty()) first = picture.rgb;
        CHECK((picture.rgb == first));
    }
}

TEST_CASE("NaN, infinite and hidden points do not harm a picture", "[io][picture][extreme]")
{
    const float huge = 1e30f, none = std::numeric_limits<float>::quiet_NaN();
    PointSet points = balls({{none, 0, 0}, {huge, -huge, huge}, {0, 0, 10}, {0, 0, 9.9999f}, {0, 0, 0}},
                            {red, red, red, red, green}, 0.5f);
    points.column<float>("pscale").write()[2] = std::numeric_limits<float>::infinity();
    points.column<Vec3f>("Cd").write()[1] = Vec3f(none, none, none);
    points.v().fill(Vec3f(huge, none, 0));

    CHECK(is_green(render(points, small, {}, front_view()).pixel(160, 100)));
    const PictureView view = PictureFit().next(points, {});
    CHECK(view.camera.position.allFinite());
    CHECK(std::isfinite(view.full_speed));
}

TEST_CASE("the fitted camera sees all points and shapes, and no more than it needs", "[io][picture]")
{
    const float scale = GENERATE(1e-3f, 1.0f, 1e5f);
    CAPTURE(scale);
    PointSet points = random_points({.size = 2000, .extent = scale});
    for (Vec3f& v : points.v().write()) v *= 0.1f * scale;
    auto scene = std::make_shared<PictureScene>();
    scene->bodies.push_back({make_sphere(scale, 16, {2.0 * scale, 0, 0})});

    const PictureView view = PictureFit().next(points, {.scene = scene});

    double widest = 0;
    const auto seen = [&](const Vec3f& P) {
        const Vec3d s = view.camera.project(P.cast<double>(), 1280, 720);
        CHECK((s.z() > 0 && s.x() > 0 && s.x() < 1280 && s.y() > 0 && s.y() < 720));
        widest = std::max({widest, std::abs(s.x() / 640 - 1), std::abs(s.y() / 360 - 1)});
    };
    for (std::size_t i = 0; i < points.size(); i += 20) seen(points.P()[i]);
    for (const Vec3f& P : scene->bodies[0].mesh->positions) seen(P);
    CHECK(widest > 0.6);
}

TEST_CASE("over a sequence the camera only glides back, and is still while everything is in view", "[io][picture]")
{
    PictureFit fit;
    PointSet points = random_points({.size = 500, .extent = 1});
    points.v().fill(Vec3f::Zero());
    double distance = 0;
    for (int frame = 0; frame < 48; ++frame) {
        const bool spreads = frame >= 24;
        if (spreads)
            for (Vec3f& P : points.P().write()) P *= 1.05f;
        const PictureView view = fit.next(points, {.number = frame + 1, .time = frame / 24.0});
        const double now = (view.camera.position - view.camera.target).norm();
        CAPTURE(frame, distance, now);
        if (frame > 0 && !spreads) CHECK(now == Approx(distance).epsilon(1e-12));
        if (frame > 0 && spreads) CHECK((now > distance && now < 1.06 * distance));
        distance = now;
    }
}

TEST_CASE("a picture's options set its camera and its size", "[io][picture]")
{
    PictureOptions options = small;
    options.position = Vec3d(0, 0, 10);
    options.target = Vec3d(0, 0, 0);
    options.fov = std::acos(0.0);
    const PointSet points = balls({{1, 2, 0}}, {red}, 0.5f);
    const PictureView view = PictureFit().next(points, {.picture = std::make_shared<PictureOptions>(options)});

    const Picture picture = render(points, options, {}, view);

    CHECK(picture.width == 320);
    CHECK(picture.rgb.size() == 320 * 200 * 3);
    CHECK(is_red(picture.pixel(170, 80)));
}

TEST_CASE("a .png file is 1280 x 720 pixels by default", "[io][picture]")
{
    const TemporaryFolder folder;
    write_points(folder / "a.png", random_points({.size = 100}));
    const std::string bytes = file_text(folder / "a.png");
    CHECK(bytes.substr(0, 8) == "\x89PNG\r\n\x1a\n");
    CHECK(bytes.substr(12, 12) == std::string("IHDR\x00\x00\x05\x00\x00\x00\x02\xd0", 12));
    CHECK(bytes.substr(bytes.size() - 8, 4) == "IEND");

    const auto options = std::make_shared<PictureOptions>(PictureOptions{.width = 0});
    CHECK(error_of([&] { write_points(folder / "b.png", PointSet(), {.picture = options}); }) ==
          (folder / "b.png").string() +
              ": a picture of 0 x 720 can't be made; each side must be from 1 to 16384 pixels");
}
