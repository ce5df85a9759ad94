#include <fmt/format.h>

#include "runtime/shapes/mesh/mesh.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

const std::string xyz = "property float x\nproperty float y\nproperty float z\n";

class PlyFolder {
public:
    MeshPtr read(const std::string& text) const
    {
        std::ofstream(folder_ / "a.ply", std::ios::binary) << text;
        return read_mesh(folder_ / "a.ply");
    }
    // Returns the error without the file's name.
    std::string error(const std::string& text) const
    {
        std::string message = error_of([&] { read(text); });
        const std::string start = "cannot read the mesh \"" + (folder_ / "a.ply").string() + "\": ";
        REQUIRE(message.starts_with(start));
        return message.substr(start.size());
    }

private:
    TemporaryFolder folder_;
};

std::string square_file(const std::string& faces, const std::string& body)
{
    return "ply\nformat ascii 1.0\nelement vertex 4\n" + xyz + "element face " + faces +
           "\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + body;
}

}  // namespace

TEST_CASE("an index without a vertex is an error that names the face", "[mesh][ply]")
{
    const PlyFolder folder;
    CHECK(folder.error(square_file("1", "3 0 1 1000000\n")) ==
          "face 0 has the vertex 1000000; the mesh has 4, numbered from 0");
    CHECK(folder.error(square_file("2", "3 0 1 2\n3 0 1 4\n")) ==
          "face 1 has the vertex 4; the mesh has 4, numbered from 0");
    CHECK(folder.error(square_file("1", "3 0 1 -1\n")) == "face 0 has the vertex -1; the mesh has 4, numbered from 0");
}

TEST_CASE("elements before and after the vertices are skipped", "[mesh][ply]")
{
    const PlyFolder folder;
    const MeshPtr mesh = folder.read(
        "ply\nformat ascii 1.0\nelement camera 1\nproperty list uchar float lens\nproperty int shots\nelement vertex "
        "3\n" +
        xyz + "element edge 1\nproperty int vertex1\nproperty int vertex2\nelement face 1\nproperty uchar red\n" +
        "property list uchar uint vertex_index\nend_header\n2 0.5 0.25 9\n0 0 0\n1 0 0\n0 1 0\n0 1\n255 3 0 1 2\n");
    CHECK(mesh->positions.size() == 3);
    CHECK(mesh->triangles.size() == 1);
}

TEST_CASE("a damaged mesh .ply is an error that says how", "[mesh][ply]")
{
    const PlyFolder folder;
    CHECK(folder.error(square_file("3", "3 0 1 2\n3 0 2 3\n")) ==
          "face 2 of 3: vertex_indices is missing; the file ends early or is damaged");
    CHECK_THAT(folder.error(square_file("1000000", "3 0 1 2\n")),
               Catch::StartsWith("the file ends early: its header announces"));
    CHECK(folder.error(
              "ply\nformat ascii 1.0\nelement face 0\nproperty list uchar int vertex_indices\nelement vertex 0\n" +
              xyz + "end_header\n") == "the faces come before the vertices");
    CHECK(folder.error("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n") ==
          "the vertices have no x y z");
    CHECK(folder.error("ply\nformat ascii 1.0\nelement vertex 0\n" + xyz +
                       "element face 0\nproperty int kind\nend_header\n") == "the faces have no list vertex_indices");
}

TEST_CASE("a polygon of any shape keeps its area, and a convex one is a fan", "[mesh][ply]")
{
    const PlyFolder folder;
    const MeshPtr quad = folder.read(square_file("1", "4 0 1 2 3\n"));
    REQUIRE(quad->triangles.size() == 2);
    CHECK((quad->triangles[0] == Mesh::Triangle(0, 1, 2) && quad->triangles[1] == Mesh::Triangle(0, 2, 3)));

    // A comb with twelve corners, four of them concave: 2 x 1 m without two teeth of 0.5 x 0.5 m.
    const int start = GENERATE(range(0, 12));
    const std::vector<Vec3f> comb = {{0, 0, 0},        {2, 0, 0},        {2, 1, 0},     {1.75f, 1, 0},
                                     {1.75f, 0.5f, 0}, {1.25f, 0.5f, 0}, {1.25f, 1, 0}, {0.75f, 1, 0},
                                     {0.75f, 0.5f, 0}, {0.25f, 0.5f, 0}, {0.25f, 1, 0}, {0, 1, 0}};
    std::string text = "ply\nformat ascii 1.0\nelement vertex 12\n" + xyz +
                       "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    std::string face = "12";
    for (int i = 0; i < 12; ++i) {
        const Vec3f& P = comb[static_cast<std::size_t>((start + i) % 12)];
        text += fmt::format("{} {} 0\n", P.x(), P.y());
        face += fmt::format(" {}", i);
    }
    const MeshPtr mesh = folder.read(text + face + "\n");
    CHECK(mesh->triangles.size() == 10);
    CHECK(mesh->area() == Approx(1.5));
    for (const Mesh::Triangle& t : mesh->triangles) {
        const Vec3f a = mesh->positions[t[0]], b = mesh->positions[t[1]], c = mesh->positions[t[2]];
        CHECK((b - a).cross(c - a).z() > 0);
    }
}

namespace {

// A polygon with this many corners that spirals inwards at right angles and back next to itself, 0.5 m wide. Has its
// area, and its outline starting at the corner `first`, as a file that repeats the face `times` times.
struct Spiral {
    explicit Spiral(int corners) : half(corners / 2)
    {
        Vec3d P = Vec3d::Zero();
        double length = half;
        for (int k = 0; k < half; ++k) {
            const Vec3d along = direction(k), before = direction(k + 3), across(-along.y(), along.x(), 0),
                        across_before(-before.y(), before.x(), 0);
            outer.push_back(P);
            inner.push_back(P + 0.5 * (k == 0          ? across
                                       : k + 1 == half ? across_before
                                                       : Vec3d(across + across_before)));
            P += length * along;
            if (k % 2 == 1) length -= 2;
        }
        for (int k = 0; k + 1 < half; ++k)
            area += 0.25 * ((outer[k + 1] - outer[k]).norm() + (inner[k + 1] - inner[k]).norm());
    }
    std::string file(int first, int times) const
    {
        std::vector<Vec3d> outline = outer;
        outline.insert(outline.end(), inner.rbegin(), inner.rend());
        std::rotate(outline.begin(), outline.begin() + first, outline.end());
        std::string text = fmt::format("ply\nformat ascii 1.0\nelement vertex {}\n", outline.size()) + xyz +
                           fmt::format("element face {}\nproperty list int int vertex_indices\nend_header\n", times);
        std::string face = std::to_string(outline.size());
        for (std::size_t k = 0; k < outline.size(); ++k) {
            text += fmt::format("{} {} 0\n", outline[k].x(), outline[k].y());
            face += fmt::format(" {}", k);
        }
        for (int k = 0; k < times; ++k) text += face + "\n";
        return text;
    }

    int half;
    double area = 0;
    std::vector<Vec3d> outer, inner;

private:
    static Vec3d direction(int k) { return k % 4 < 2 ? Vec3d::Unit(k % 2) : Vec3d(-Vec3d::Unit(k % 2)); }
};

}  // namespace

// A cubic algorithm takes ten seconds for the thousand polygons and a day for the long one.
TEST_CASE("polygons that wind are cut, whichever corner is first, many of them and long ones", "[mesh][ply]")
{
    const PlyFolder folder;
    const std::pair<int, int> size = GENERATE(std::pair(256, 1000), std::pair(4000, 1));
    const int corners = size.first, times = size.second;
    const Spiral spiral(corners);
    const MeshPtr mesh = folder.read(spiral.file(GENERATE_COPY(0, corners / 3, corners / 2 + 1), times));
    CHECK(mesh->triangles.size() == static_cast<std::size_t>(times * (corners - 2)));
    CHECK(mesh->area() == Approx(times * spiral.area).epsilon(1e-9));
}

TEST_CASE("a polygon whose cutting takes too long is an error that names the face", "[mesh][ply]")
{
    const PlyFolder folder;
    CHECK(folder.error(Spiral(100000).file(0, 1)) ==
          "face 0 has 100000 corners in a line too winding to be cut into triangles; divide it");
}

TEST_CASE("every number of the vertices of a PLY is a value of the mesh; three that belong together are a vec3",
          "[mesh][ply]")
{
    const PlyFolder folder;
    const MeshPtr mesh = folder.read("ply\nformat ascii 1.0\nelement vertex 3\n" + xyz +
                                     "property float nx\nproperty float ny\nproperty float nz\nproperty uchar kind\n"
                                     "property float flowx\nproperty float flowy\nproperty float flowz\n"
                                     "property double heat\nproperty int ax\nproperty int ay\nproperty int az\n"
                                     "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                     "0 0 0 0 1 0 7 1 2 3 0.5 1 2 3\n1 0 0 0 0 1 8 4 5 6 0.25 4 5 6\n"
                                     "0 1 0 1 0 0 9 7 8 9 -1 7 8 9\n3 0 1 2\n");
    std::vector<std::string> names;
    for (const auto& [name, values] : mesh->values) names.push_back(name);
    CHECK(names == std::vector<std::string>{"N", "ax", "ay", "az", "flow", "heat", "kind"});
    CHECK(std::get<std::vector<float>>(mesh->values.at("heat")) == std::vector<float>{0.5f, 0.25f, -1});
    CHECK(std::get<std::vector<float>>(mesh->values.at("kind")) == std::vector<float>{7, 8, 9});
    CHECK_THAT(std::get<std::vector<Vec3f>>(mesh->values.at("flow"))[1], close_to(Vec3f(4, 5, 6), 0));
    CHECK_THAT(std::get<std::vector<Vec3f>>(mesh->values.at("N"))[2], close_to(Vec3f(1, 0, 0), 0));
}
