#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "runtime/base/error.h"
#include "runtime/shapes/mesh/mesh.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using Catch::Matchers::Equals;
using rapid::test::close_to;
using rapid::test::TemporaryFolder;

namespace {

using std::numbers::pi;

// Returns the path of a shared asset.
std::filesystem::path asset(const std::string& name)
{
    return std::filesystem::path(RAPID_SOURCE_DIR).parent_path() / "shared/assets" / name;
}

// A cube with edge 1 at the origin: eight corners, quads, and separate normals and texture coordinates on each face.
const std::string cube_obj = R"(
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 -1
vn 0 0 1
vn 0 -1 0
vn 0 1 0
vn -1 0 0
vn 1 0 0
f 1/1/1 4/2/1 3/3/1 2/4/1
f 5/1/2 6/2/2 7/3/2 8/4/2
f 1/1/3 2/2/3 6/3/3 5/4/3
f 4/1/4 8/2/4 7/3/4 3/4/4
f 1/1/5 5/2/5 8/3/5 4/4/5
f 2/1/6 3/2/6 7/3/6 6/4/6
)";

std::string as_stl(const Mesh& mesh)
{
    std::ostringstream text;
    text << "solid made\n";
    for (const Mesh::Triangle& t : mesh.triangles) {
        text << "facet normal 0 0 0\nouter loop\n";
        for (const int i : t)
            text << "vertex " << mesh.positions[i].x() << ' ' << mesh.positions[i].y() << ' ' << mesh.positions[i].z()
                 << '\n';
        text << "endloop\nendfacet\n";
    }
    text << "endsolid made\n";
    return text.str();
}

std::string base64(const std::string& bytes)
{
    static const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i + 2 < bytes.size(); i += 3) {  // the number of bytes is a multiple of three
        unsigned word = 0;
        for (int k = 0; k < 3; ++k) word = word << 8 | static_cast<unsigned char>(bytes[i + k]);
        for (int k = 18; k >= 0; k -= 6) text += digits[word >> k & 63];
    }
    return text;
}

}  // namespace

TEST_CASE("a box mesh has exactly the area and volume of its box", "[mesh]")
{
    const MeshPtr box = make_box({1, 2, 4}, {10, 0, -3});
    CHECK(box->area() == 2 * (1 * 2 + 2 * 4 + 4 * 1));
    CHECK(box->signed_volume() == 8);
    CHECK(box->openness().closed());
    CHECK_THAT(box->bounds().min(), close_to(Vec3f{9.5f, -1, -5}, 0));
    CHECK_THAT(box->bounds().max(), close_to(Vec3f{10.5f, 1, -1}, 0));
}

TEST_CASE("a sphere mesh has its vertices on the sphere and comes nearer to it with the square of its divisions",
          "[mesh]")
{
    const double radius = 0.5;
    const Vec3d center(1, -2, 3);
    double area_error[2], volume_error[2];
    for (const int k : {0, 1}) {
        const MeshPtr mesh = make_sphere(radius, 40 << k, center);
        for (const Vec3f& P : mesh->positions)
            REQUIRE((P.cast<double>() - center).norm() == Approx(radius).margin(4e-7));
        CHECK(mesh->openness().closed());
        area_error[k] = 4 * pi * radius * radius - mesh->area();
        volume_error[k] = 4.0 / 3 * pi * std::pow(radius, 3) - mesh->signed_volume();
    }
    CHECK(area_error[0] / area_error[1] == Approx(4).epsilon(0.02));
    CHECK(volume_error[0] / volume_error[1] == Approx(4).epsilon(0.02));
    CHECK((volume_error[1] > 0 && volume_error[1] < 2e-3));  // inside the sphere and near it
}

TEST_CASE("a torus mesh comes to the area and volume of Pappus with the square of its divisions", "[mesh]")
{
    const double radius = 1, tube = 0.25;
    double area_error[2], volume_error[2];
    for (const int k : {0, 1}) {
        const MeshPtr mesh = make_torus(radius, tube, 64 << k, Vec3d::Zero());
        CHECK(mesh->openness().closed());
        area_error[k] = 4 * pi * pi * radius * tube - mesh->area();
        volume_error[k] = 2 * pi * pi * radius * tube * tube - mesh->signed_volume();
    }
    CHECK(area_error[0] / area_error[1] == Approx(4).epsilon(0.02));
    CHECK(volume_error[0] / volume_error[1] == Approx(4).epsilon(0.02));
}

TEST_CASE("built-in meshes are closed and face outwards at their fewest divisions", "[mesh]")
{
    for (const MeshPtr& mesh : {make_sphere(1, 3, Vec3d::Zero()), make_torus(1, 0.01, 3, Vec3d::Zero())}) {
        CAPTURE(mesh->name);
        CHECK(mesh->openness().closed());
        CHECK(mesh->signed_volume() > 0);
    }
}

TEST_CASE("a grid mesh faces up and is open along its rim", "[mesh]")
{
    const MeshPtr grid = make_grid(3, 2, 5, {0, 7, 0});
    CHECK(grid->area() == Approx(6).epsilon(1e-6));
    CHECK(grid->positions.size() == 36);
    for (const Mesh::Triangle& t : grid->triangles) {
        const Vec3f a = grid->positions[t[0]], b = grid->positions[t[1]], c = grid->positions[t[2]];
        CHECK_THAT((b - a).cross(c - a).normalized().eval(), close_to(Vec3f{0, 1, 0}, 0));
    }
    CHECK(grid->openness().boundary_edges == 4 * 5);
    CHECK(grid->openness().non_manifold_edges == 0);
    CHECK(grid->bounds().min().y() == 7);
}

TEST_CASE("openness counts the edges of a missing and of a turned face", "[mesh]")
{
    Mesh missing = *make_box({1, 1, 1}, Vec3d::Zero());
    missing.triangles.pop_back();
    CHECK(missing.openness().boundary_edges == 3);
    CHECK(missing.openness().odd_edges == 3);
    CHECK(missing.openness().non_manifold_edges == 0);

    Mesh turned = *make_box({1, 1, 1}, Vec3d::Zero());
    std::swap(turned.triangles[0][0], turned.triangles[0][1]);
    CHECK(turned.openness().boundary_edges == 0);
    CHECK(turned.openness().odd_edges == 0);
    CHECK(turned.openness().non_manifold_edges == 3);
}

TEST_CASE("a mesh keeps its sense when a map mirrors it, and its volume scales with the map's determinant", "[mesh]")
{
    const MeshPtr torus = make_torus(1, 0.3, 24, Vec3d::Zero());
    const double volume = torus->signed_volume();
    CHECK(transformed(torus, Eigen::Affine3d(Eigen::Scaling(-1.0, 1.0, 1.0)))->signed_volume() == Approx(volume));
    CHECK(transformed(torus, Eigen::Affine3d(Eigen::Scaling(2.0, 2.0, 3.0)))->signed_volume() == Approx(12 * volume));

    // Single precision resolves 1 mm at 1e4 m. The volume is computed about the mesh instead of the world's origin.
    const MeshPtr far = transformed(torus, Eigen::Affine3d(Eigen::Translation3d(1e4, 0, 0)));
    CHECK(far->signed_volume() == Approx(volume).epsilon(1e-3));
    CHECK_THAT(far->bounds().center(), close_to(Vec3f{1e4f, 0, 0}, 1e-3));
}

TEST_CASE("faces of many points are split into fans", "[mesh]")
{
    const MeshPtr mesh = make_mesh({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0.5f, 2, 0}, {0, 1, 0}}, {{0, 1, 2, 3, 4}});
    CHECK(mesh->triangles.size() == 3);
    CHECK(mesh->area() == 1.5);
}

TEST_CASE("wrong arguments of built-in meshes are refused with their value", "[mesh]")
{
    const Vec3d o = Vec3d::Zero();
    CHECK_THAT(test::error_of([&] { make_sphere(-1, 8, o); }),
               Equals("radius of a mesh sphere = -1 is out of range; it must be above 0"));
    CHECK_THAT(test::error_of([&] { make_sphere(1, 2, o); }),
               Equals("divisions of a mesh sphere = 2 is out of range; it must be from 3 to 32000"));
    CHECK_THAT(test::error_of([&] {
                   make_box({1, 0, 1}, o);
               }),
               Equals("size of a mesh box = 0 is out of range; it must be above 0"));
    CHECK_THAT(test::error_of([&] { make_grid(1, 1, 0, o); }),
               Equals("divisions of a mesh grid = 0 is out of range; it must be from 1 to 32000"));
    CHECK_THAT(test::error_of([&] { make_torus(1, 2, 8, o); }),
               Equals("tube of a mesh torus = 2 is out of range; it must be below its radius, 1"));
    CHECK_THAT(test::error_of([&] {
                   make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}});
               }),
               Equals("face 0 of a mesh names point 3; points are numbered from 0 to 2"));
    CHECK_THAT(test::error_of([&] {
                   make_mesh({{0, 0, 0}, {1, 0, 0}}, {{0, 1}});
               }),
               Equals("face 0 of a mesh has 2 points; it must have at least 3"));
    CHECK_THAT(test::error_of([&] {
                   make_mesh({{0, 0, NAN}}, {});
               }),
               Equals("point 0 of a mesh is at (0, 0, nan); coordinates must be finite"));
}

TEST_CASE("vertices that a file splits or repeats are merged by position", "[mesh][read]")
{
    const TemporaryFolder folder;
    for (const auto& path : {folder.write("cube.obj", cube_obj),
                             folder.write("cube.stl", as_stl(*make_box({1, 1, 1}, {0.5, 0.5, 0.5})))}) {
        CAPTURE(path);
        const MeshPtr cube = read_mesh(path);
        CHECK(cube->positions.size() == 8);
        CHECK(cube->triangles.size() == 12);
        CHECK(cube->openness().closed());
        CHECK(cube->signed_volume() == 1);
        CHECK(cube->values.empty());
        CHECK(cube->name == path.string());
    }
}

TEST_CASE("a binary PLY may begin with any byte", "[mesh][read]")
{
    const TemporaryFolder folder;
    for (int byte = 0; byte < 256; ++byte) {
        std::array<float, 9> P{0, 0, 0, 1, 0, 0, 0, 1, 0};
        P[0] = std::bit_cast<float>(0xBE969600u + byte);
        std::string text =
            "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
            "float "
            "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        text.append(reinterpret_cast<const char*>(P.data()), sizeof P);
        const std::array<std::int32_t, 3> face{0, 1, 2};
        text += '\3';
        text.append(reinterpret_cast<const char*>(face.data()), sizeof face);
        const MeshPtr mesh = read_mesh(folder.write("byte.ply", text));
        CAPTURE(byte);
        REQUIRE(mesh->positions.size() == 3);
        CHECK(mesh->positions[0].x() == P[0]);
        CHECK(mesh->positions[2] == Vec3f(0, 1, 0));
    }
}

TEST_CASE("vertex colours of a PLY become Cd, in the order of the file", "[mesh][read]")
{
    const TemporaryFolder folder;
    const MeshPtr mesh = read_mesh(folder.write("coloured.ply", R"(ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element face 2
property list uchar int vertex_indices
end_header
0 0 0 255 0 0
1 0 0 0 255 0
1 1 0 0 0 255
0 1 0 51 51 51
3 0 2 3
3 0 1 2
)"));
    REQUIRE(mesh->positions.size() == 4);
    CHECK_THAT(mesh->positions[3], close_to(Vec3f{0, 1, 0}, 0));
    REQUIRE(mesh->values.size() == 1);
    const auto& Cd = std::get<std::vector<Vec3f>>(mesh->values.at("Cd"));
    REQUIRE(Cd.size() == 4);
    CHECK_THAT(Cd[0], close_to(Vec3f{1, 0, 0}, 0));
    CHECK_THAT(Cd[2], close_to(Vec3f{0, 0, 1}, 0));
    CHECK_THAT(Cd[3], close_to(Vec3f{0.2f, 0.2f, 0.2f}, 1e-6));
}

TEST_CASE("a glTF mesh is placed by the transform of its node", "[mesh][read]")
{
    const float corners[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const std::string buffer = base64(std::string(reinterpret_cast<const char*>(corners), sizeof corners));
    const TemporaryFolder folder;
    const MeshPtr mesh = read_mesh(folder.write("triangle.gltf",
                                                R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "translation": [5, 0, 0], "scale": [2, 2, 2]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                           "min": [0, 0, 0], "max": [1, 1, 0]}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,)" +
                                                    buffer + "\"}]}"));
    REQUIRE(mesh->positions.size() == 3);
    CHECK_THAT(mesh->positions[0], close_to(Vec3f{5, 0, 0}, 0));
    CHECK_THAT(mesh->positions[1], close_to(Vec3f{7, 0, 0}, 0));
    CHECK_THAT(mesh->positions[2], close_to(Vec3f{5, 2, 0}, 0));
}

TEST_CASE("files that are not meshes are refused with their name and the fault", "[mesh][read]")
{
    const TemporaryFolder folder;
    // Returns the error of reading a file with this name and content, without the folder's name.
    const auto refusal = [&](const char* name, const char* content) {
        const auto path = content ? folder.write(name, content) : folder / name;
        std::string message = test::error_of([&] { read_mesh(path); });
        const std::string in = folder.path().string() + "/";
        if (const auto at = message.find(in); at != std::string::npos) message.erase(at, in.size());
        return message;
    };
    CHECK_THAT(refusal("none.obj", nullptr), Equals("there is no mesh file \"none.obj\""));
    CHECK_THAT(refusal("scene.fbx", "x"),
               Equals("\"scene.fbx\" can't be read as a mesh; it must be .obj, .ply, .stl, .gltf or .glb"));
    CHECK_THAT(refusal("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 1\nf 1 2 2\n"),
               Equals("the mesh \"points.obj\" has 2 vertices but no faces; a mesh needs at least one triangle"));
    CHECK_THAT(refusal("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"),
               Equals("vertex 1 of the mesh \"nan.obj\" is at (nan, 0, 0); coordinates must be finite"));
    CHECK_THAT(refusal("broken.ply", "ply\nthis is no header\n"),
               Equals("cannot read the mesh \"broken.ply\": not a valid PLY file: line 2 of its header can't be "
                      "understood"));
    CHECK_THAT(refusal("broken.glb", "this is no header\n"),
               Catch::Matchers::StartsWith("cannot read the mesh \"broken.glb\": its JSON is damaged: "));
}

TEST_CASE("a scanned mesh and an animated one are read as their makers describe them", "[mesh][read]")
{
    if (!std::filesystem::exists(asset("meshes/spot.obj"))) {
        WARN("left out: there is no " << asset("meshes/spot.obj"));
        return;
    }
    const MeshPtr spot = read_mesh(asset("meshes/spot.obj"));
    CHECK(spot->positions.size() == 2930);
    CHECK(spot->triangles.size() == 5856);
    CHECK(spot->openness().closed());
    CHECK(spot->signed_volume() == Approx(0.1487).margin(5e-5));
    CHECK_THAT(spot->bounds().max(), close_to(Vec3f{0.279f, 1, 0.508f}, 5e-4));

    const MeshPtr jumper = read_mesh(asset("jumper/jumper.0060.ply"));
    CHECK(jumper->positions.size() == 3334);
    CHECK(jumper->triangles.size() == 6664);
    CHECK(jumper->openness().closed());
}
