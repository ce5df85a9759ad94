// Shapes of a frame, and pictures of points among them.
#include "bindings/scene/scene_inside.h"
#include "include/rapid/shapes.h"

#include <cmath>

#include "include/rapid/scene.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains, Catch::StartsWith;
using test::good;

Scene opened(const std::string& text) { return test::opened("local rapid = require 'rapid'\n" + text); }

// A resting sphere emits points, which fall on a plane and on a box that rises by a metre per frame.
const char* const shapes_of_all_kinds =
    "return rapid.create {} :emit { source = rapid.mesh.sphere { radius = 0.5, center = {0, 3, 0} }, rate = 100 }"
    ":gravity {} :collide { shape = rapid.shape.plane { normal = {0, 1, 0}, offset = -2 } }"
    ":collide { shape = rapid.shape.box { size = {2, 2, 2} },"
    "transform = function(frame) return rapid.translate(0, frame.number, 0) end } :solve {}";

const char* const resting =
    "return rapid.create { points = rapid.points.grid {} } :gravity {}"
    ":collide { shape = rapid.shape.box { size = {2, 4, 6} } } :solve {}";

double highest(const ShapeMesh& mesh)
{
    double y = -INFINITY;
    for (std::size_t i = 0; i < mesh.corner_count; ++i) y = std::max<double>(y, mesh.positions[3 * i + 1]);
    return y;
}

}  // namespace

TEST_CASE("a box is reported as a mesh", "[shapes]")
{
    Scene scene = opened(resting);
    const SceneShapes shapes = good(scene.shapes(1));
    REQUIRE(shapes.meshes().size() == 1);
    CHECK(shapes.planes().empty());
    const ShapeMesh box = shapes.meshes().front();
    CHECK(box.role == ShapeRole::Collider);
    CHECK(box.corner_count >= 8);
    CHECK(box.triangle_count >= 12);
    // Its volume, by the divergence theorem: the triangles are counter-clockwise seen from outside.
    double volume = 0;
    for (std::size_t t = 0; t < box.triangle_count; ++t) {
        const float* corner[3];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int32_t place = box.triangles[3 * t + k];
            REQUIRE((place >= 0 && static_cast<std::size_t>(place) < box.corner_count));
            corner[k] = box.positions + 3 * place;
        }
        const auto& [a, b, c] = corner;
        volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                   a[2] * (b[0] * c[1] - b[1] * c[0])) /
                  6;
    }
    CHECK(volume == Approx(48));
}

TEST_CASE("shapes that rest are the same in all frames, and outlive the scene", "[shapes]")
{
    SceneShapes kept;
    CHECK(kept == SceneShapes());
    {
        Scene scene = opened(resting);
        kept = good(scene.shapes(1));
        CHECK(kept == good(scene.shapes(9)));
        CHECK(kept.meshes().front().owner == good(scene.shapes(9)).meshes().front().owner);
        CHECK_FALSE(kept == SceneShapes());
        CHECK(scene.next_frame() == 1);
    }
    CHECK(highest(kept.meshes().front()) == Approx(2));
}

TEST_CASE("shapes have their positions in the frame, and their roles", "[shapes]")
{
    Scene scene = opened(shapes_of_all_kinds);
    const SceneShapes second = good(scene.shapes(2)), fifth = good(scene.shapes(5));
    CHECK_FALSE(second == fifth);
    REQUIRE(second.meshes().size() == 2);
    CHECK(second.meshes()[0].role == ShapeRole::Emitter);
    CHECK(second.meshes()[1].role == ShapeRole::Collider);
    CHECK(highest(second.meshes()[1]) == Approx(3));
    CHECK(highest(fifth.meshes()[1]) == Approx(6));
    CHECK(second.meshes()[0].owner == fifth.meshes()[0].owner);
    REQUIRE(second.planes().size() == 1);
    CHECK(second.planes()[0].normal == std::array{0.0, 1.0, 0.0});
    CHECK(second.planes()[0].offset == Approx(-2));
}

TEST_CASE("a shape that can't be made in a frame is an error of it", "[shapes]")
{
    Scene scene = opened(
        "return rapid.create {} :gravity {} :collide { shape = function(frame) if frame.number > 1 then "
        "error 'no shape' end return rapid.shape.plane {} end } :solve {}");
    const auto shapes = scene.shapes(2);
    REQUIRE_FALSE(shapes);
    CHECK_THAT(shapes.error().message, Contains("no shape"));
}

TEST_CASE("shapes in a file are those that were written, and pictures of them the same", "[shapes]")
{
    const test::TemporaryFolder folder;
    Scene scene = opened(shapes_of_all_kinds);
    const SceneFrame frame = good(scene.advance_to(3));
    const SceneShapes shapes = good(scene.shapes(3));
    good(SceneInside::save(shapes, folder / "deep/shapes"));
    const SceneShapes read = good(SceneInside::load_shapes(folder / "deep/shapes"));
    REQUIRE(read.meshes().size() == 2);
    CHECK(read.meshes()[0].role == ShapeRole::Emitter);
    CHECK(highest(read.meshes()[1]) == highest(shapes.meshes()[1]));
    CHECK(read.planes()[0].offset == shapes.planes()[0].offset);
    CHECK(good(frame.picture(read, {}, {64, 48})) == good(frame.picture(shapes, {}, {64, 48})));

    good(SceneInside::save(SceneShapes(), folder / "none"));
    CHECK(good(SceneInside::load_shapes(folder / "none")).meshes().empty());
}

TEST_CASE("a file that holds no shapes is an error that names it", "[shapes]")
{
    const test::TemporaryFolder folder;
    Scene scene = opened(resting);
    good(SceneInside::save(good(scene.advance()), folder / "frame", ""));
    const SceneError other = SceneInside::load_shapes(folder / "frame").error();
    CHECK_THAT(other.text(), StartsWith((folder / "frame").string() +
                                        ": it contains the frame of a scene; it must contain the shapes"));
    CHECK_FALSE(SceneInside::load_shapes(folder / "missing"));
    CHECK_FALSE(SceneInside::load_shapes(folder.write("text", "no shapes")));
    CHECK_FALSE(SceneInside::save(SceneShapes(), folder / "text/below"));

    good(SceneInside::save(good(scene.shapes(1)), folder / "shapes"));
    const std::string whole = test::file_text(folder / "shapes");
    CHECK_FALSE(SceneInside::load_shapes(folder.write("torn", whole.substr(0, whole.size() / 2))));
}

TEST_CASE("a picture needs no scene, and is seen from where the program says", "[shapes]")
{
    Scene scene = opened(resting);
    const SceneFrame frame = good(scene.advance_to(2));
    const SceneShapes shapes = good(scene.shapes(2));
    const std::string fitted = good(frame.picture(shapes, {}, {64, 48}));
    CHECK(fitted == good(scene.picture(frame, {64, 48})));
    PictureCamera camera;
    camera.position = {20, 10, 0};
    camera.target = {0, 0, 0};
    camera.fov = 30;
    const std::string from_aside = good(frame.picture(shapes, camera, {64, 48}));
    CHECK_THAT(from_aside, StartsWith("\x89PNG"));
    CHECK(from_aside != fitted);
    CHECK(good(frame.picture({}, camera, {64, 48})) != from_aside);

    for (const double fov : {0.0, -30.0, 180.0, std::nan("")}) {
        camera.fov = fov;
        CHECK_THAT(frame.picture(shapes, camera).error().message, Contains("it must be between 0 and 180 degrees"));
    }
    for (const PictureSize size : {PictureSize{0, 48}, PictureSize{64, -1}, PictureSize{20000, 48}}) {
        const auto picture = frame.picture(shapes, {}, size);
        REQUIRE_FALSE(picture);
        CHECK_THAT(picture.error().message, Contains("each side must be from 1 to 16384 pixels"));
    }
}

TEST_CASE("a frame has the camera of its picture: the scene's, the program's, or a fitted one", "[shapes]")
{
    const std::string points = "return rapid.create { points = rapid.points.from { P = {{1, 2, 3}} } } :solve {}";
    Scene plain = opened(points);
    const SceneFrame alone = good(plain.advance());
    CHECK_FALSE(good(plain.shapes(1)).has_camera());
    const PictureCamera fitted = good(SceneInside::camera(alone, good(plain.shapes(1))));
    CHECK(std::hypot((*fitted.target)[0] - 1, (*fitted.target)[1] - 2, (*fitted.target)[2] - 3) < 1e-6);
    CHECK((*fitted.position)[1] > 2);  // from above

    Scene scene = opened(points + ":picture { camera = rapid.camera { position = {0, 8, 1}, target = {0, 1, 0} } }");
    const SceneFrame frame = good(scene.advance());
    const SceneShapes shapes = good(scene.shapes(1));
    CHECK(shapes.has_camera());
    const PictureCamera of_scene = good(SceneInside::camera(frame, shapes));
    CHECK(*of_scene.position == std::array{0.0, 8.0, 1.0});
    CHECK(*of_scene.target == std::array{0.0, 1.0, 0.0});
    CHECK(std::abs(*of_scene.fov - 35) < 0.1);
    PictureCamera other;
    other.position = {3, 3, 3};
    CHECK(*good(SceneInside::camera(frame, shapes, other)).position == *other.position);
    other.fov = 180;
    CHECK_FALSE(SceneInside::camera(frame, shapes, other));
}

}  // namespace rapid
