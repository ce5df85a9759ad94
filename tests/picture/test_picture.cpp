#include "runtime/picture/picture.h"

#include <tbb/global_control.h>

#include <array>
#include <cmath>

#include "runtime/io/format.h"
#include "runtime/picture/picture_fit.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

// Returns a view from 10 m in front of the origin, 90° high, so that a metre at the origin is height / 20 pixels.
PictureView front_view()
{
    PictureView view;
    view.camera = {Vec3d(0, 0, 10), Vec3d::Zero(), std::acos(0.0)};
    view.bounds = Box3d(Vec3d(-10, -10, -10), Vec3d(10, 10, 10));
    view.line_spacing = 2;
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

    const Camera above{Vec3d(0, 4, 0), Vec3d::Zero(), 1.0};  // straight down, along the usual up vector
    CHECK_THAT(above.project({0, 0, 0}, 320, 200), close_to(Vec3d(160, 100, 4), 1e-4));
}

TEST_CASE("a point is drawn as a disc of its radius, where the camera projects it", "[io][picture]")
{
    const PointSet points = balls({{1, 2, 0}}, {red}, 0.5f);  // a radius of 5 pixels around (170, 80)

    const Picture picture = render(points, small, {}, front_view());

    CHECK(is_red(picture.pixel(170, 80)));
    CHECK(is_red(picture.pixel(166, 80)));
    CHECK(is_red(picture.pixel(173, 80)));
    CHECK(is_background(picture.pixel(164, 80)));
    CHECK(is_background(picture.pixel(175, 80)));
    CHECK(is_background(picture.pixel(150, 120)));
    // Its edge is smooth: the sum of its light matches that of its area to a few per cent.
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
    CHECK_FALSE(is_background(pixel(hidden, {1.5, 1.5, 0})));  // the collider itself is visible

    scene.bodies[0].role = PictureScene::Body::Emitter;
    CHECK(is_green(pixel(render(points, small, scene, front_view()), {1, 0, -1})));
}

TEST_CASE("a vessel does not hide the points in it", "[io][picture]")
{
    PictureScene scene;
    scene.bodies.push_back({.mesh = make_box({4, 4, 4}, {0, 0, 0}), .is_vessel = true});
    const PointSet points = balls({{0, 0, 0}, {0.1f, 0, 0}}, {red, red}, 0.3f);

    CHECK(is_red(render(points, small, scene, front_view()).pixel(160, 100)));
    scene.bodies[0].is_vessel = false;
    CHECK_FALSE(is_red(render(points, small, scene, front_view()).pixel(160, 100)));
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
    CHECK(seen({{Vec3d(0, 0, -1), -3}}).rgb == open.rgb);  // free space is z < 3; the camera is outside it
    const Picture behind = seen({{Vec3d(0, 0, 1), -3}});   // free space is z > -3
    CHECK(is_red(behind.pixel(160, 100)));
    CHECK(behind.rgb != open.rgb);
}

// Returns the linear light that points add to the background, summed over a picture, per channel.
double light_of(const PointSet& points, const PictureScene& scene)
{
    const auto sum = [](const Picture& picture) {
        double light = 0;
        for (const std::uint8_t byte : picture.rgb) {
            const double c = byte / 255.0;
            light += c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
        }
        return light;
    };
    return sum(render(points, small, scene, front_view())) - sum(render(PointSet(), small, scene, front_view()));
}

PictureScene styled(const PointStyle& style)
{
    PictureScene scene;
    scene.styles = {style};
    return scene;
}

TEST_CASE("a streak has the light of its disc, spread along the way during the exposure", "[io][picture]")
{
    const Vec3f way = GENERATE(Vec3f(4, 0, 0), Vec3f(0, -3, 0), Vec3f(2.1f, 1.3f, 0), Vec3f(0.3f, 0.2f, 0));
    CAPTURE(way);
    PointSet points = balls({{1, 2, 0}}, {Vec3f(0.7f, 0.7f, 0.7f)}, 0.4f);
    const double still = light_of(points, styled({.additive = true}));
    points.v().write()[0] = way;
    const PictureScene scene = styled({.additive = true, .shutter = 1});

    // The sum over all pixels only has the error of rounding to bytes.
    CHECK(light_of(points, scene) == Approx(still).epsilon(0.04));
    // Halfway back it is as bright as at its end, and one length further there is nothing.
    const Picture picture = render(points, small, scene, front_view());
    const Picture empty = render(PointSet(), small, scene, front_view());
    const auto added = [&](const Vec3f& P) {
        const Vec3d s = front_view().camera.project(P.cast<double>(), small.width, small.height);
        const int x = static_cast<int>(s.x()), y = static_cast<int>(s.y());
        return picture.pixel(x, y)[0] - empty.pixel(x, y)[0];
    };
    if (way.norm() < 1) return;
    CHECK(added(Vec3f(1, 2, 0) - 0.5f * way) > 20);
    CHECK(added(Vec3f(1, 2, 0) - 1.3f * way) == 0);
    CHECK(added(Vec3f(1, 2, 0) + 0.3f * way) == 0);
}

TEST_CASE("a card covers a disc times the cosine between its normal and the view", "[io][picture]")
{
    PointSet points = balls({{0, 0, 0}}, {Vec3f(0.3f, 0.3f, 0.3f)}, 2);
    const double disc = light_of(points, styled({.additive = true}));
    points.add({"orient", Quatf(Quatf::Identity())});
    for (const double degrees : {90.0, 60.0, 30.0, -45.0}) {  // from the ground towards the viewer; -: its back
        CAPTURE(degrees);
        const double angle = degrees * std::acos(-1.0) / 180;
        points.column<Quatf>("orient").write()[0] = Quatf(Eigen::AngleAxisf(static_cast<float>(angle), Vec3f::UnitX()));
        CHECK(light_of(points, styled({.additive = true, .cards = true})) ==
              Approx(disc * std::abs(std::sin(angle))).epsilon(0.03));
        CHECK(light_of(points, styled({.additive = true, .cards = false})) == disc);
    }
    // A card that faces the light is brighter than one that is turned away from it by 60°.
    const auto shaded = [&](const Vec3f& normal) {
        const Vec3f n = normal.normalized(), axis = Vec3f::UnitY().cross(n);  // of the shortest turn from y to n
        points.column<Quatf>("orient").write()[0] = Quatf(1 + n.y(), axis.x(), axis.y(), axis.z()).normalized();
        return render(points, small, styled({.cards = true}), front_view()).pixel(160, 100)[1];
    };
    CHECK(shaded(Vec3f(-0.3f, 0.4f, 1)) > shaded(Vec3f(0.6f, -0.8f, 1)) + 20);
}

TEST_CASE("a card lies across its normal, and a collider hides the half behind it", "[io][picture]")
{
    PointSet points = balls({{0, 0, 0}}, {green}, 2);
    points.add({"orient", Quatf(Quatf::Identity())});
    const auto looks_at = [&](const PictureScene& scene, const Vec3f& normal, const Vec3d& P) {
        const Vec3f n = normal.normalized(), axis = Vec3f::UnitY().cross(n);  // of the shortest turn from y to n
        points.column<Quatf>("orient").write()[0] = Quatf(1 + n.y(), axis.x(), axis.y(), axis.z()).normalized();
        const Vec3d s = front_view().camera.project(P, small.width, small.height);
        const Picture picture = render(points, small, scene, front_view());
        return is_green(picture.pixel(static_cast<int>(s.x()), static_cast<int>(s.y())));
    };
    PictureScene scene = styled({.cards = true});
    CHECK(looks_at(scene, {1, 1, 0.5f}, {1.06, -1.06, 0}));
    CHECK_FALSE(looks_at(scene, {1, 1, 0.5f}, {1.06, 1.06, 0}));
    scene.bodies.push_back(quad(0));
    CHECK(looks_at(scene, {0, 1, 1}, {0, -0.7, 0.7}));
    CHECK_FALSE(looks_at(scene, {0, 1, 1}, {0, 0.7, -0.7}));
}

TEST_CASE("a ball that hardly moves is shaded as one at rest", "[io][picture]")
{
    PointSet points = balls({{0, 0, 0}}, {{0.4f, 0.4f, 0.4f}}, 2);
    const Picture still = render(points, small, {}, front_view());
    points.v().fill(Vec3f(0.06f, 0, 0));  // 0.6 pixels
    const Picture moving = render(points, small, styled({.shutter = 1}), front_view());
    for (int y = 88; y <= 112; y += 4)
        for (int x = 148; x <= 172; x += 4) {
            CAPTURE(x, y);
            CHECK(std::abs(moving.pixel(x, y)[1] - still.pixel(x, y)[1]) <= 6);
        }
}

TEST_CASE("a streak begins where its point was born", "[io][picture]")
{
    PointSet points = balls({{0, 0, 0}}, {red}, 0.4f);
    points.v().write()[0] = Vec3f(6, 0, 0);
    points.add({"age", 0.5f});
    const Picture picture = render(points, small, styled({.additive = true, .shutter = 1}), front_view());
    CHECK(picture.pixel(160 - 20, 100)[0] > 60);
    CHECK(is_background(picture.pixel(160 - 45, 100)));
}

TEST_CASE("additive points add up, in any order, and hide nothing", "[io][picture]")
{
    const Vec3f dim(0.2f, 0.1f, 0.05f);
    const PictureScene adds = styled({.additive = true});
    const double one = light_of(balls({{0, 0, 1}}, {dim}, 0.5f), adds);
    const double other = light_of(balls({{0, 0, -1}}, {dim}, 0.5f), adds);
    const double both = light_of(balls({{0, 0, 1}, {0, 0, -1}}, {dim, dim}, 0.5f), adds);
    CHECK(both == Approx(one + other).epsilon(0.03));
    CHECK(light_of(balls({{0, 0, -1}, {0, 0, 1}}, {dim, dim}, 0.5f), adds) == both);
    // The nearer one hides the other in the area of overlap.
    CHECK(light_of(balls({{0, 0, 1}, {0, 0, -1}}, {dim, dim}, 0.5f), {}) < 0.8 * both);
}

TEST_CASE("Alpha lets through what is behind a point", "[io][picture]")
{
    PointSet points = balls({{0, 0, 1}, {0, 0, -1}}, {red, green}, 0.5f);
    points.add({"Alpha", 1.0f});
    const auto center = [&] {
        return std::array{render(points, small, {}, front_view()).pixel(160, 100)[0],
                          render(points, small, {}, front_view()).pixel(160, 100)[1]};
    };
    CHECK(center()[1] < 40);
    points.column<float>("Alpha").write()[0] = 0.5f;
    CHECK((center()[0] > 60 && center()[1] > 60));
    points.column<float>("Alpha").write()[0] = 0;
    CHECK((center()[0] < 40 && center()[1] > 100));
}

TEST_CASE("what shines casts no shadow, and the rest does", "[io][picture]")
{
    PictureView view = front_view();
    view.camera.position = Vec3d(0, 6, 10);
    view.bounds = Box3d(Vec3d(-2, -1, -2), Vec3d(2, 3, 2));
    const auto darkest = [&](const Vec3f& colour, const PointStyle& style) {
        PictureScene scene = styled(style);
        scene.planes.push_back({Vec3d::UnitY(), -1});
        const Picture with = render(balls({{0, 1, 0}}, {colour}, 0.3f), small, scene, view);
        const Picture without = render(PointSet(), small, scene, view);
        int most = 0;
        for (std::size_t k = 0; k < with.rgb.size(); ++k) most = std::max(most, without.rgb[k] - with.rgb[k]);
        return most;
    };
    CHECK(darkest({0.5f, 0.5f, 0.5f}, {}) > 5);
    CHECK(darkest({0.5f, 0.5f, 0.5f}, {.additive = true}) == 0);
    CHECK(darkest({2, 2, 2}, {}) <= 1);  // its edge covers a little of the ground
}

TEST_CASE("a ball casts no shadow on itself, wherever it is", "[io][picture]")
{
    PictureView view = front_view();
    view.camera.position = Vec3d(0.3, 0.4, 1.5);
    view.camera.target = Vec3d(0.3, 0.4, 0);
    view.bounds = Box3d(Vec3d(-2, -1, -2), Vec3d(2, 3, 2));
    for (const float radius : {0.06f, 0.1f, 0.2f, 0.5f}) {
        int darkest = 255, lightest = 0;
        for (int k = 0; k < 24; ++k) {  // through several slices of the lit region, at arbitrary positions in its cells
            const auto x = static_cast<float>(k % 3) * 0.3f, y = static_cast<float>(k) * 0.037f;
            const Picture picture = render(balls({{x, y, 0}}, {{0.4f, 0.4f, 0.4f}}, radius), small, {}, view);
            const int at = *std::max_element(picture.rgb.begin(), picture.rgb.end());
            darkest = std::min(darkest, at);
            lightest = std::max(lightest, at);
        }
        CAPTURE(radius, darkest, lightest);
        CHECK(lightest - darkest <= 12);  // part of it comes from the position of the centre within a pixel
    }
}

TEST_CASE("the shadow of a ball is as large as the ball", "[io][picture]")
{
    PictureView view = front_view();
    view.camera.position = Vec3d(0, 12, 0.01);
    view.bounds = Box3d(Vec3d(-3, -3, -3), Vec3d(3, 3, 3));
    PictureScene scene;
    scene.planes.push_back({Vec3d::UnitY(), -1});
    for (const float radius : {0.25f, 0.4f, 0.6f}) {
        // The lamp is above and to the left, so the shadow falls to the right of the ball.
        const Picture with = render(balls({{-1, 2.5f, 0}}, {{0.1f, 0.1f, 0.1f}}, radius), small, scene, view);
        const Picture without = render(PointSet(), small, scene, view);
        int most = 0;
        const auto darker = [&](int x, int y) { return without.pixel(x, y)[1] - with.pixel(x, y)[1]; };
        const int left = static_cast<int>(160 + 100 * (-1 + radius) / (12 - 2.5)) + 3;
        for (int y = 0; y < 200; ++y)
            for (int x = left; x < 320; ++x) most = std::max(most, darker(x, y));
        int area = 0;  // pixels in which the shadow is at least half as deep as its deepest
        for (int y = 0; y < 200; ++y)
            for (int x = left; x < 320; ++x) area += 2 * darker(x, y) > most;
        const double pixel = (12 + 1) / 100.0, slope = std::hypot(0.45, 0.85 + 0.35) / (0.85 + 0.35);
        CAPTURE(radius, most, area);
        CHECK(most > 10);
        CHECK(area * pixel * pixel == Approx(EIGEN_PI * radius * radius * slope).epsilon(0.3));
    }
}

TEST_CASE("a style is that of a group, and the later one counts", "[io][picture]")
{
    PointSet points = balls({{-2, 0, 0}, {2, 0, 0}}, {red, red}, 0.3f);
    points.v().fill(Vec3f(0, 3, 0));
    points.group("fast").write()[1] = 1;
    PictureScene scene = styled({.group = "fast", .shutter = 1});
    const auto streaks = [&](int x) {
        return !is_background(render(points, small, scene, front_view()).pixel(x, 112));
    };
    CHECK_FALSE(streaks(140));
    CHECK(streaks(180));
    scene.styles.push_back({.additive = true});  // does not set the shutter
    CHECK(streaks(180));
    scene.styles.push_back({.shutter = 0});
    CHECK_FALSE(streaks(180));
}

TEST_CASE("an earlier style applies to parameters that a later one does not set", "[picture]")
{
    const PointSet points = balls({{0, 0, 0}}, {Vec3f(0.2f, 0.1f, 0.05f)}, 0.3f);
    const PictureScene adding = styled({.additive = true});
    PictureScene exposed = adding;
    exposed.styles.push_back({.shutter = 0.02});
    const Picture shining = render(points, small, adding, front_view());
    CHECK(render(points, small, exposed, front_view()).rgb == shining.rgb);  // at rest
    exposed.styles.push_back({.additive = false});
    CHECK(render(points, small, exposed, front_view()).rgb == render(points, small, {}, front_view()).rgb);
    CHECK(shining.rgb != render(points, small, {}, front_view()).rgb);
}

TEST_CASE("a painter draws what one for a single picture draws, whatever it has drawn before", "[io][picture]")
{
    auto scene = std::make_shared<PictureScene>();
    scene->bodies.push_back({make_torus(1, 0.3, 24, {0, 0, 0})});
    scene->bodies.push_back({.mesh = make_box({5, 5, 5}, {0, 0, 0}), .is_vessel = true});
    scene->planes.push_back({Vec3d::UnitY(), -1});
    PointSet points = random_points({.size = 3000});
    PictureView view = PictureFit().next(points, {.scene = scene});
    Painter painter;
    for (int frame = 0; frame < 6; ++frame) {
        CAPTURE(frame);
        CHECK((painter.draw(points, small, scene, view).rgb == render(points, small, *scene, view).rgb));
        for (Vec3f& P : points.P().write()) P = P * 1.2f + Vec3f(0.3f, 0, 0);
        if (frame == 2) view.camera.position += Vec3d(1, 0, 0);
        if (frame == 3) points = PointSet();
    }
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
    points.column<float>("pscale").fill(0.01f * scale);
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

TEST_CASE("the fitted camera sees the whole of large points", "[io][picture]")
{
    const PictureView view = PictureFit().next(balls({{-2, 0, 0}, {2, 0, 0}}, {red, green}, 1.5f), {});
    for (const double x : {-2.0, 2.0})
        for (const Vec3d& side : {Vec3d(1.5, 0, 0), Vec3d(0, 1.5, 0), Vec3d(0, 0, 1.5)})
            for (const double sign : {-1.0, 1.0}) {
                const Vec3d s = view.camera.project(Vec3d(x, 0, 0) + sign * side, 1280, 720);
                CHECK((s.x() > 0 && s.x() < 1280 && s.y() > 0 && s.y() < 720));
            }
}

TEST_CASE("over a sequence the camera holds still, and glides back a few times when points leave it", "[io][picture]")
{
    PictureFit fit;
    PointSet points = random_points({.size = 500, .extent = 1});
    points.v().fill(Vec3f::Zero());
    double distance = 0;
    int rests = 0;  // frames in which the camera rests while points spread
    for (int frame = 0; frame < 240; ++frame) {
        const bool spreads = frame >= 24;
        if (spreads)
            for (Vec3f& P : points.P().write()) P *= 1.005f;  // after 9 s three times as wide
        const PictureView view = fit.next(points, {.number = frame + 1, .time = frame / 24.0});
        const double now = (view.camera.position - view.camera.target).norm();
        CAPTURE(frame, distance, now);
        if (frame > 0 && !spreads) CHECK(now == distance);
        if (frame > 0 && spreads) CHECK((now >= distance && now < 1.06 * distance));
        rests += spreads && now == distance;
        distance = now;
        for (std::size_t i = 0; i < points.size(); i += 10) {
            const Vec3d s = view.camera.project(points.P()[i].cast<double>(), 1280, 720);
            CHECK((s.x() > 0 && s.x() < 1280 && s.y() > 0 && s.y() < 720));
        }
    }
    CHECK(rests > 216 / 2);
}

// From straight above, lines are where the picture changes along a row.
TEST_CASE("the lines on the ground keep their scale over a sequence, however wide the scene becomes", "[io][picture]")
{
    PictureOptions options{.width = 400, .height = 400};
    options.position = Vec3d(0, 20, 0);
    options.target = Vec3d::Zero();
    PictureFit fit;
    const auto lines = [&](double reach, int frame) {
        const PointSet points = balls({{float(-reach), 0, 0}, {float(reach), 0, 0}}, {red, red}, 1e-3f);
        const FrameInfo info{
            .number = frame, .time = frame / 24.0, .picture = std::make_shared<PictureOptions>(options)};
        const PictureView view = fit.next(points, info);
        const Picture picture = render(PointSet(), options, {}, view);
        int found = 0;
        for (int x = 1; x < 399; ++x) {
            const auto light = [&](int at) { return picture.pixel(at, 190)[1]; };
            found += light(x) > light(x - 1) && light(x) >= light(x + 1) && light(x) > light(0) + 3;
        }
        return std::pair(found, view.line_spacing);
    };
    const auto first = lines(2.5, 1);
    CHECK(first.first > 4);
    for (int frame = 2; frame < 60; ++frame) {
        const auto later = lines(2.5 * std::pow(1.05, frame), frame);
        CHECK(later.second == first.second);
        if (frame == 59) CHECK(later.first >= first.first);
    }
}

TEST_CASE("a scene's camera is taken where the options give none", "[io][picture]")
{
    const PointSet points = balls({{1, 2, 0}}, {red}, 0.5f);
    auto scene = std::make_shared<PictureScene>();
    scene->camera = {Vec3d(0, 0, 10), Vec3d::Zero(), std::acos(0.0), ""};
    auto options = std::make_shared<PictureOptions>(small);
    CHECK(is_red(
        render(points, small, *scene, PictureFit().next(points, {.picture = options, .scene = scene})).pixel(170, 80)));

    options->position = Vec3d(0, 0, 20);
    const PictureView view = PictureFit().next(points, {.picture = options, .scene = scene});
    CHECK(view.camera.position == Vec3d(0, 0, 20));
    CHECK(view.camera.target == Vec3d::Zero());
}

TEST_CASE("a camera that frames a group follows it, and not the rest", "[io][picture]")
{
    PointSet points = balls({{0, 0, 0}, {0.2f, 0.1f, 0}, {50, 0, 0}, {-50, 3, 9}}, {red, red, green, green}, 0.05f);
    points.group("pair").write()[0] = points.group("pair").write()[1] = 1;
    points.v().fill(Vec3f(0.24f, 0.48f, 0));
    auto scene = std::make_shared<PictureScene>();
    scene->camera.group = "pair";
    PictureFit fit;
    for (int frame = 0; frame < 96; ++frame) {
        for (int i : {0, 1}) points.P().write()[i] += Vec3f(0.01f, 0.02f, 0);
        const PictureView view = fit.next(points, {.number = frame + 1, .time = frame / 24.0, .scene = scene});
        const Vec3d pair = (points.P()[0] + points.P()[1]).cast<double>() / 2;
        const Vec3d seen = view.camera.project(pair, 1280, 720);
        CAPTURE(frame);
        CHECK((std::abs(seen.x() - 640) < 2 && std::abs(seen.y() - 360) < 2));
        CHECK((view.camera.position - pair).norm() < 5);
    }
}

TEST_CASE("a camera that frames a group sees the scene until somebody is in it", "[io][picture]")
{
    PointSet points = balls({{3, 1, 0}, {-2, 0, 0}}, {red, green}, 0.05f);
    auto scene = std::make_shared<PictureScene>();
    scene->camera.group = "late";
    PictureFit fit;
    const PictureView first = fit.next(points, {.number = 1, .scene = scene});
    for (const Vec3d& P : {Vec3d(3, 1, 0), Vec3d(-2, 0, 0)}) {
        const Vec3d s = first.camera.project(P, 1280, 720);
        CHECK((s.x() > 0 && s.x() < 1280 && s.y() > 0 && s.y() < 720));
    }
    CHECK(fit.next(points, {.number = 2, .time = 1 / 24.0, .scene = scene}).camera.position == first.camera.position);
    points.group("late").write()[0] = 1;
    const PictureView later = fit.next(points, {.number = 3, .time = 2 / 24.0, .scene = scene});
    const Vec3d seen = later.camera.project({3, 1, 0}, 1280, 720);
    CHECK((std::abs(seen.x() - 640) < 2 && std::abs(seen.y() - 360) < 2));
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
