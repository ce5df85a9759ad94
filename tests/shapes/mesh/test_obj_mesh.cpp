// OBJ meshes of other programs.
#include "runtime/shapes/mesh/detailed_mesh.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

class ObjFolder {
public:
    DetailedMeshPtr read(const std::string& text) const { return detailed(read_mesh(folder_.write("a.obj", text))); }
    // Returns the error without the file's name.
    std::string error(const std::string& text) const
    {
        std::string message = error_of([&] { read(text); });
        const std::string start = "cannot read the mesh \"" + (folder_ / "a.obj").string() + "\": ";
        REQUIRE(message.starts_with(start));
        return message.substr(start.size());
    }

private:
    TemporaryFolder folder_;
};

const std::vector<Vec3f> triangle = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

}  // namespace

TEST_CASE("marks, comments, continued lines and any end of a line change nothing of an .obj mesh", "[mesh][obj]")
{
    const ObjFolder folder;
    for (const std::string text :
         {"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
          "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r", "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n",
          "v 0 0 0 # a\n#v 5 5 5\nv 1 0 0\n\tv 0 1 0\nf 1 2 3 # b\n\n",
          "v 0 0 \\\n0\nv 1 \\\r\n 0 0\nv 0 1 0\nf 1 2\\\n3\n", "v +0 -.0 0.\nv 1. 0 0\nv 0 +1e0 0\nf 1 2 3",
          "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"}) {
        CAPTURE(text);
        const auto mesh = folder.read(text);
        CHECK(mesh->positions == triangle);
        REQUIRE(mesh->triangles.size() == 1);
        CHECK(mesh->triangles[0] == Mesh::Triangle(0, 1, 2));
    }
}

TEST_CASE("an .obj without its material file has its groups, by object, group and material", "[mesh][obj]")
{
    const auto mesh = ObjFolder().read(
        "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no my plane\ng left all\nusemtl old wood\nf 1 2 3\n"
        "g right\nf 1 3 4\n");
    const std::map<std::string, std::vector<std::uint8_t>> expected = {{"my plane", {1, 1}}, {"left", {1, 0}},
                                                                       {"all", {1, 0}},      {"left all", {1, 0}},
                                                                       {"right", {0, 1}},    {"old wood", {1, 1}}};
    CHECK(mesh->face_groups == expected);
    CHECK(mesh->skipped.empty());
}

TEST_CASE("an .obj has colours after the positions, and values at corners by their own indices", "[mesh][obj]")
{
    const auto mesh = ObjFolder().read(
        "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nvt 0.25\nvt 0.5 0.75 1\nvn 0 0 2\n"
        "f -3/1/1 -2/2/-1 -1//1\n");
    CHECK(std::get<std::vector<Vec3f>>(mesh->values.at("Cd")) == std::vector<Vec3f>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
    CHECK(std::get<std::vector<Vec3f>>(mesh->values.at("uv")) ==
          std::vector<Vec3f>{{0.25f, 0, 0}, {0.5f, 0.75f, 1}, {0, 0, 0}});
    CHECK(std::get<std::vector<Vec3f>>(mesh->values.at("N")) == std::vector<Vec3f>(3, {0, 0, 1}));
}

TEST_CASE("a polygon of an .obj that is not convex keeps its area", "[mesh][obj]")
{
    const auto mesh = ObjFolder().read("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 0.5 0\nv 0 2 0\nf 1 2 3 4 5\n");
    CHECK(mesh->triangles.size() == 3);
    CHECK(mesh->area() == 2.5);  // the square without a triangle of base 2 and height 1.5
    CHECK(mesh->signed_volume() == 0);
}

TEST_CASE("an index or number of an .obj that is wrong is an error that names the line", "[mesh][obj]")
{
    const ObjFolder folder;
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    CHECK(folder.error(vertices + "f 1 2 4\n") == "line 4: a face has the vertex 4; there are 3, from 1");
    CHECK(folder.error(vertices + "f 1 2 99999999999\n") ==
          "line 4: a face has the vertex 2147483648; there are 3, from 1");
    CHECK(folder.error(vertices + "f 0 1 2\n") ==
          "line 4: there is no vertex 0 of 3; they count from 1, or backwards from -1");
    CHECK(folder.error(vertices + "f 1 2 -4\n") ==
          "line 4: there is no vertex -4 of 3; they count from 1, or backwards from -1");
    // Births need no normals.
    const auto mesh = folder.read(vertices + "f 1//1 2//1 3//1\n");
    CHECK(mesh->area() == 0.5);
    CHECK(mesh->skipped == std::vector<std::string>{"faces have a N that the file lacks; it is taken as 0"});
    const auto mixed = folder.read(vertices + "f 1//1 2//1 3//1\nf 1 3 2\n");
    CHECK(std::get<std::vector<Vec3f>>(mixed->values.at("N")) == std::vector<Vec3f>(3, Vec3f::Zero()));
    CHECK(folder.error(vertices + "f 1 2 x\n") == "line 4: \"x\" is not a number");
    CHECK(folder.error("v 0 0\n") == "line 1: \"\" is not a number");
}
