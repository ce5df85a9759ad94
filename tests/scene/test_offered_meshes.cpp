// Meshes that a program offers again for each frame: they move and deform like those of a sequence of files.
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <optional>

#include "include/rapid/scene.h"
#include "include/rapid/shapes.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains;
using test::good;

constexpr float half = 0.125f;

// A box with half edges of 1, 0.125 and 1 m, after a map of its vertices.
HostMesh box(const std::function<std::array<float, 3>(float x, float y, float z)>& map)
{
    HostMesh mesh;
    for (const float x : {-1.0f, 1.0f})
        for (const float y : {-half, half})
            for (const float z : {-1.0f, 1.0f}) mesh.positions.push_back(map(x, y, z));
    mesh.triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                      {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
    return mesh;
}

// The box with its top at this height.
HostMesh plate(double top)
{
    return box([&](float x, float y, float z) -> std::array<float, 3> {
        return {x, static_cast<float>(top + (y - half)), z};
    });
}

// The box turned by 12 degrees a frame, while it bends and grows.
HostMesh paddle(std::int64_t frame)
{
    const double f = static_cast<double>(frame - 1), angle = 0.21 * f, c = std::cos(angle), s = std::sin(angle);
    return box([&](float x, float y, float z) -> std::array<float, 3> {
        const double bent = (1 + 0.03 * f) * y + 0.05 * f * x * z;
        return {static_cast<float>(c * x - s * bent), static_cast<float>(s * x + c * bent), z};
    });
}

// A tetrahedron: another topology.
HostMesh tetrahedron()
{
    HostMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    return mesh;
}

void write_ply(const test::TemporaryFolder& folder, std::int64_t frame, const HostMesh& mesh)
{
    std::string text = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement "
        "face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.positions.size(), mesh.triangles.size());
    for (const auto& [x, y, z] : mesh.positions) text += fmt::format("{:.9g} {:.9g} {:.9g}\n", x, y, z);
    for (const auto& [a, b, c] : mesh.triangles) text += fmt::format("3 {} {} {}\n", a, b, c);
    folder.write(fmt::format("body.{:04}.ply", frame), text);
}

const std::string offered = "function() return rapid.host 'body' end";
const std::string offered_shape =
    "function() return rapid.levelset.from_mesh(rapid.host 'body', { voxel = 0.0625 }) end";

// Births on the body, which the parameters of the emitter complete.
std::string births(const std::string& source, const std::string& parameters = "")
{
    return "local rapid = require 'rapid'\nreturn rapid.create { fps = 24, seed = 5 } :emit { source = " + source +
           ", rate = 2400" + parameters + " } :solve {}";
}

// A grid of points that the body meets.
std::string pushed(const std::string& shape)
{
    return "local rapid = require 'rapid'\nreturn rapid.create { fps = 24, points = rapid.points.grid { size = {2, 1, "
           "2}, spacing = 0.125 } }\n:collide { shape = " +
           shape + ", bounce = 0.25, friction = 0.2 } :solve {}";
}

// Both at once, with a force of the moving surface and another that changes with time.
std::string everything(const std::string& source, const std::string& shape)
{
    return "local rapid = require 'rapid'\nreturn rapid.create { fps = 24, seed = 5, points = rapid.points.grid { size "
           "= {2, 1, 2}, spacing = 0.25 } }\n:emit { source = " +
           source + ", rate = 600, speed = 1 }\n:attract { shape = " + shape +
           ", strength = function(frame) return 2 + frame.time end, falloff = 0 }\n:collide { shape = " + shape +
           ", bounce = 0.25, friction = 0.2 } :solve {}";
}

Scene opened_with(const std::string& text, const HostMesh& body, int threads = 0)
{
    SceneOptions options;
    options.threads = threads;
    options.objects = {{"body", body}};
    return test::opened(text, std::move(options));
}

// Offers each frame's mesh up to the last one, and computes it.
SceneFrame run_to(Scene& scene, std::int64_t last, const std::function<HostMesh(std::int64_t)>& mesh_of)
{
    for (;;) {
        good(scene.offer("body", mesh_of(scene.next_frame())));
        SceneFrame frame = good(scene.advance());
        if (frame.number() == last) return frame;
    }
}

std::string bits_of(const SceneFrame& frame)
{
    std::string bits;
    for (const char* name : {"id", "P", "v"}) {
        const SceneColumn column = good(frame.expanded(name));
        const std::size_t bytes = column.type == ColumnType::Int64 ? 8 : 12;
        for (std::size_t i = 0; i < column.count; ++i)
            bits.append(static_cast<const char*>(column.data) + i * column.stride, bytes);
    }
    return bits;
}

const float* at(const SceneFrame& frame, const char* name, std::size_t i) { return frame.column(name)->at<float>(i); }

}  // namespace

TEST_CASE("an offered plate that rises at 2.4 m/s lifts points at 2.4 m/s", "[offers]")
{
    const double speed = 2.4;
    const auto rising = [&](std::int64_t frame) { return plate(speed / 24 * static_cast<double>(frame - 1)); };
    const std::string text =
        "local rapid = require 'rapid'\nreturn rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.55, "
        "0}, "
        "{0.5, 0.25, 0.5}, {0, 5, 0}} } }\n:collide { shape = " +
        offered_shape + ", bounce = 0 } :solve {}";
    Scene scene = opened_with(text, rising(1));
    for (std::int64_t frame = 1; frame <= 12; ++frame) {
        const SceneFrame now = run_to(scene, frame, rising);
        CAPTURE(frame);
        const double top = speed / 24 * static_cast<double>(frame - 1);
        const std::pair<std::size_t, double> heights[] = {{0, 0.55}, {1, 0.25}, {2, 5}};
        for (const auto& [i, height] : heights) {
            CHECK(at(now, "P", i)[1] == Approx(std::max(height, top)).margin(1e-4));
            CHECK(at(now, "v", i)[1] == Approx(height < top ? speed : 0).margin(1e-4));
        }
        CHECK(now.statistics().penetration_max < 1e-4);
        CHECK(now.warnings().empty());
    }
}

TEST_CASE("points born on an offered mesh in motion have its velocity", "[offers]")
{
    // The box grows by a tenth of its first size in each frame, so its surface at X moves by 2.4 X per second.
    const auto growing = [](std::int64_t frame) {
        const float scale = 1 + 0.1f * static_cast<float>(frame - 1);
        return box([&](float x, float y, float z) -> std::array<float, 3> {
            return {scale * x, scale * y, scale * z};
        });
    };
    Scene scene = opened_with(births(offered), growing(1));
    REQUIRE(run_to(scene, 1, growing).size() == 0);
    std::size_t before = 0;
    for (std::int64_t frame = 2; frame <= 6; ++frame) {
        const SceneFrame now = run_to(scene, frame, growing);
        REQUIRE(now.size() == before + 100);
        const double scale = 1 + 0.1 * static_cast<double>(frame - 1);
        for (std::size_t i = before; i < now.size(); ++i)
            for (int axis = 0; axis < 3; ++axis)
                REQUIRE(at(now, "v", i)[axis] == Approx(2.4 / scale * at(now, "P", i)[axis]).margin(1e-4));
        before = now.size();
    }

    // Points that do not inherit the velocity stay at their birthplaces, along the path.
    const auto rising = [](std::int64_t frame) { return plate(0.1 * static_cast<double>(frame - 1)); };
    Scene still = opened_with(births(offered, ", inherit_velocity = 0, birth = 'even'"), rising(1));
    const SceneFrame second = run_to(still, 2, rising);
    int below = 0;
    for (std::size_t i = 0; i < second.size(); ++i) below += at(second, "P", i)[1] < 0.1f - 2 * half - 1e-4f;
    CHECK(below > 10);  // of the lower face, which starts at -0.25 m and ends at -0.15 m
}

TEST_CASE("offered meshes give the bits of the same meshes as a sequence of files up to their frame", "[offers]")
{
    // The files of later frames do not exist yet when a frame is computed, as the program has not offered them either.
    const std::string file = "rapid.mesh.read 'body.####.ply'";
    const std::string file_shape = "rapid.levelset.from_mesh(" + file + ", { voxel = 0.0625 })";
    const auto [of_host, of_files] =
        GENERATE_COPY(std::pair(births(offered), births(file)),
                      std::pair(births(offered, ", from = 'points', motion = 'linear'"),
                                births(file, ", from = 'points', motion = 'linear'")),
                      std::pair(births(offered, ", from = 'volume'"), births(file, ", from = 'volume'")),
                      std::pair(pushed(offered_shape), pushed(file_shape)),
                      std::pair(everything(offered, offered_shape), everything(file, file_shape)));
    const test::TemporaryFolder folder;
    Scene host = opened_with(of_host, paddle(1));
    std::optional<SceneSnapshot> last;
    for (std::int64_t frame = 1; frame <= 7; ++frame) {
        write_ply(folder, frame, paddle(frame));
        Scene files = good(Scene::open_text(folder / "scene.lua", of_files, {}));
        if (last) good(files.restore(*last));
        const SceneFrame expected = good(files.advance());
        last = good(files.save());
        CAPTURE(of_host, frame);
        REQUIRE((frame == 1 || expected.size() > 0));
        CHECK((bits_of(run_to(host, frame, paddle)) == bits_of(expected)));
    }
}

TEST_CASE("offered meshes in uniform motion give the bits of the complete sequence of files", "[offers]")
{
    // All positions and their differences are exact in binary, so tangents by later frames are the same.
    const auto stretching = [](std::int64_t frame) {
        const auto f = static_cast<float>(frame - 1);
        return box([&](float x, float y, float z) -> std::array<float, 3> {
            return {x * (1 + f / 64), y + f / 16 + f * x / 128, z};
        });
    };
    const test::TemporaryFolder folder;
    for (std::int64_t frame = 1; frame <= 9; ++frame) write_ply(folder, frame, stretching(frame));
    const std::string file = "rapid.mesh.read 'body.####.ply'";
    const std::string file_shape = "rapid.levelset.from_mesh(" + file + ", { voxel = 0.0625 })";
    Scene files = good(Scene::open_text(folder / "scene.lua", everything(file, file_shape), {}));
    Scene host = opened_with(everything(offered, offered_shape), stretching(1));
    for (std::int64_t frame = 1; frame <= 8; ++frame) {
        CAPTURE(frame);
        CHECK((bits_of(run_to(host, frame, stretching)) == bits_of(good(files.advance()))));
    }
}

TEST_CASE("an offered mesh in motion gives the same bits on any number of threads", "[offers][threads]")
{
    const auto bits = [](int threads) {
        Scene scene = opened_with(everything(offered, offered_shape), paddle(1), threads);
        return bits_of(run_to(scene, 6, paddle));
    };
    CHECK((bits(1) == bits(2)));
}

TEST_CASE("after a restart offered meshes begin at rest again, and the same offers give the same bits", "[offers]")
{
    Scene scene = opened_with(everything(offered, offered_shape), paddle(1));
    const std::string expected = bits_of(run_to(scene, 6, paddle));
    const SceneFrame held = good(scene.advance());
    const std::string held_bits = bits_of(held);
    good(scene.restart());
    CHECK((bits_of(run_to(scene, 6, paddle)) == expected));
    good(scene.set("emit1.rate", 600.0));  // runs the file again
    CHECK((bits_of(run_to(scene, 6, paddle)) == expected));
    CHECK((bits_of(held) == held_bits));
}

TEST_CASE("after a snapshot is restored, the same offers give the same bits", "[offers][snapshots]")
{
    const std::int64_t saved = GENERATE(1, 2, 4);
    const test::TemporaryFolder folder;
    const std::string text = everything(offered, offered_shape), file = (folder / "snapshot").string();
    Scene scene = opened_with(text, paddle(1));
    run_to(scene, saved, paddle);
    const SceneSnapshot snapshot = good(scene.save());
    good(snapshot.write(file));
    const std::string expected = bits_of(run_to(scene, 7, paddle));
    good(scene.restore(snapshot));
    CHECK((bits_of(run_to(scene, 7, paddle)) == expected));

    Scene other = opened_with(text, paddle(1));
    good(other.restore(good(SceneSnapshot::read(file))));
    CHECK((bits_of(run_to(other, 7, paddle)) == expected));
}

TEST_CASE("of several offers for one frame the last one counts", "[offers]")
{
    Scene scene = opened_with(everything(offered, offered_shape), paddle(1)),
          other = opened_with(everything(offered, offered_shape), plate(3));
    for (std::int64_t frame = 1; frame <= 5; ++frame) {
        const std::string expected = bits_of(run_to(scene, frame, paddle));
        good(other.offer("body", plate(static_cast<double>(frame))));
        good(other.offer("body", tetrahedron()));
        good(other.shapes(frame));  // takes the mesh
        CHECK((bits_of(run_to(other, frame, paddle)) == expected));
    }
}

TEST_CASE("an offered mesh rests in a frame without an offer, and moves on from there", "[offers]")
{
    const auto rising = [](std::int64_t frame) { return plate(0.25 * static_cast<double>(frame)); };
    Scene scene = opened_with(births(offered), rising(1));
    std::size_t before = run_to(scene, 3, rising).size();
    const auto expect_births = [&](const SceneFrame& now, double speed) {
        CAPTURE(now.number());
        REQUIRE(now.size() == before + 100);
        for (std::size_t i = before; i < now.size(); ++i) REQUIRE(at(now, "v", i)[1] == Approx(speed).margin(1e-4));
        before = now.size();
    };
    expect_births(good(scene.advance()), 0);
    expect_births(good(scene.advance()), 0);
    expect_births(run_to(scene, 6, rising), 3 * 0.25 * 24);  // from the height of frame 3
    expect_births(run_to(scene, 7, [](std::int64_t) { return plate(0.25 * 9); }), 3 * 0.25 * 24);
}

TEST_CASE("an offered mesh with other faces is at rest in its first frame, with one warning", "[offers]")
{
    const auto changing = [](std::int64_t frame) {
        return frame == 4 ? tetrahedron() : plate(0.25 * static_cast<double>(frame));
    };
    Scene scene = opened_with(everything(offered, offered_shape), changing(1));
    const auto newborn_speed = [](const SceneFrame& now) {
        double fastest = 0;
        for (std::size_t i = now.size() - 10; i < now.size(); ++i)
            fastest = std::max(fastest, double{std::abs(at(now, "v", i)[1])});
        return fastest;
    };
    CHECK(run_to(scene, 3, changing).warnings().empty());
    const SceneFrame fourth = run_to(scene, 4, changing);
    REQUIRE(fourth.warnings().size() == 1);
    CHECK_THAT(fourth.warnings()[0], Contains("the program offers \"body\": at frame 4 it has other faces than before "
                                              "(4 vertices and 4 faces, not 8 vertices and 12 faces)"));
    CHECK(run_to(scene, 5, changing).warnings().empty());
    CHECK(run_to(scene, 6, changing).warnings().empty());

    Scene emitting = opened_with(births(offered), changing(1));
    CHECK(newborn_speed(run_to(emitting, 3, changing)) == Approx(6));
    CHECK(newborn_speed(run_to(emitting, 4, changing)) == 0);
    CHECK(newborn_speed(run_to(emitting, 5, changing)) == 0);
    CHECK(newborn_speed(run_to(emitting, 6, changing)) == Approx(6));

    HostMesh turned = plate(1);
    std::swap(turned.triangles[0], turned.triangles[1]);
    good(emitting.offer("body", plate(2)));
    good(emitting.restart());
    good(emitting.advance());
    good(emitting.offer("body", turned));
    CHECK_THAT(good(emitting.advance()).warnings().at(0), Contains("12 faces, which join other vertices"));
}

TEST_CASE("a level set of an offered mesh in motion still has all tools of a level set", "[offers]")
{
    const auto rising = [](std::int64_t frame) { return plate(0.25 * static_cast<double>(frame)); };
    Scene scene = opened_with(
        "local rapid = require 'rapid'\nreturn rapid.create { fps = 24, points = rapid.points.from { P = {{0, 0.9, 0}} "
        "} "
        "}\n:collide { shape = function() return rapid.levelset.from_mesh(rapid.host 'body', { voxel = 0.0625 })"
        ":offset(0.125) end, bounce = 0 } :solve {}",
        rising(1));
    const SceneFrame third = run_to(scene, 3, rising);
    CHECK(at(third, "P", 0)[1] == Approx(0.9));
    // At frame 4 the surface is at 1.125 m: it pushes the point out, as it is at rest.
    CHECK(at(run_to(scene, 4, rising), "P", 0)[1] == Approx(1.125).margin(1e-3));
}

}  // namespace rapid
