// Files of points as other programs write them.
#include <bit>

#include "runtime/files/skipped_contents.h"
#include "runtime/io/format.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

// Reads a file with these contents, with the notes of its reader.
class Files {
public:
    PointSet read(const std::string& name, const std::string& bytes)
    {
        const SkippedContents skipped;
        PointSet points = read_points(folder_.write(name, bytes));
        notes = skipped.list();
        return points;
    }
    std::string error(const std::string& name, const std::string& bytes)
    {
        return error_of([&] { read(name, bytes); });
    }

    std::vector<std::string> notes;

private:
    TemporaryFolder folder_;
};

template <class T>
std::vector<T> values(const PointSet& points, const char* name)
{
    const Column<T>& column = points.column<T>(name);
    std::vector<T> list;
    for (std::size_t i = 0; i < points.size(); ++i) list.push_back(column[i]);
    return list;
}

const std::vector<Vec3f> two = {{1, 2, 3}, {-0.5f, 0, 1e-7f}};
const std::vector<std::string> may_be_cut = {"its last line has no newline, so that its last number may be cut short"};

std::string with_line_ends(std::string text, const std::string& end)
{
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += end.size())
        text.replace(at, 1, end);
    return text;
}

std::string ply_of(const std::string& properties, const std::string& rows)
{
    return "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n" +
           properties + "end_header\n" + rows;
}

}  // namespace

TEST_CASE("text files of points have lines of any end, marks of the byte order and signed numbers", "[io][others]")
{
    Files files;
    const std::string csv = "Px,Py,Pz\n+1,2.,3\n-.5,0,1e-7\n", obj = "v +1 2. 3\nv -.5 0 1e-7\n";
    const std::string of_ply = ply_of("", "+1 2. 3\n-.5 0 1e-7\n");
    for (const auto& [name, text] : {std::pair("a.csv", csv), {"a.obj", obj}, {"a.ply", of_ply}})
        for (const char* end : {"\n", "\r\n", "\r"})
            for (const char* mark : {"", "\xef\xbb\xbf"}) {
                CAPTURE(name, end, mark);
                const std::string whole = mark + with_line_ends(text, end);
                CHECK(values<Vec3f>(files.read(name, whole), "P") == two);
                CHECK(files.notes.empty());
                CHECK(values<Vec3f>(files.read(name, whole.substr(0, whole.size() - std::string(end).size())), "P") ==
                      two);
                CHECK(files.notes == may_be_cut);
            }
}

TEST_CASE("colours of a .ply are from 0 to 1 whatever their type, and numbers of groups are no groups", "[io][others]")
{
    Files files;
    const PointSet points = files.read(
        "a.ply", ply_of("property ushort red\nproperty ushort green\nproperty ushort blue\nproperty uchar alpha\n"
                        "property uchar group_id\nproperty uchar group_hot\nproperty list uchar int near\n",
                        "1 2 3 65535 0 13107 51 0 1 2 7 8\n-.5 0 1e-7 0 65535 0 255 7 0 0\n"));
    CHECK(values<Vec3f>(points, "Cd") == std::vector<Vec3f>{{1, 0, 0.2f}, {0, 1, 0}});
    CHECK(values<float>(points, "Alpha") == std::vector<float>{0.2f, 1});
    CHECK(values<std::int32_t>(points, "group_id") == std::vector<std::int32_t>{0, 7});
    REQUIRE(points.find_group("hot"));
    CHECK((*points.find_group("hot"))[0] == 1);
    CHECK((*points.find_group("hot"))[1] == 0);
    CHECK_FALSE(points.find_group("id"));
    CHECK(files.notes == std::vector<std::string>{"not read: the list \"near\" of its vertices"});
}

TEST_CASE("a .csv has quoted names, blanks after commas, ids with a point and vectors by others' names", "[io][others]")
{
    Files files;
    for (const std::string header : {"\"id\", \"Px\", \"Py\", \"Pz\", \"kind\"", "id,x,y,z,kind", "id ,X , Y,Z,kind",
                                     "id,\"Points:0\",\"Points:1\",\"Points:2\",kind",
                                     "id,position.x,position.y,position.z,kind", "id,P[0],P[1],P[2],kind"}) {
        CAPTURE(header);
        const PointSet points = files.read("a.csv", header + "\n 7.0, 1, 2, 3, \"oak, old\"\n8 ,-.5 ,0,1e-7 , elm\n");
        CHECK(values<Vec3f>(points, "P") == two);
        CHECK(points.id()[0] == 7);
        CHECK(points.column<Token>("kind")[0].text() == "oak, old");
        CHECK(points.column<Token>("kind")[1].text() == "elm");
    }
    const PointSet moving = files.read("a.csv", "x,y,z,velocity:0,velocity:1,velocity:2\n1,2,3,4,5,6\n");
    CHECK(moving.v()[0] == Vec3f(4, 5, 6));
    CHECK_FALSE(moving.has("velocity"));
}

TEST_CASE("an empty .csv of Rapid says which columns are strings", "[io][others]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.add({"name", token_of("")});
    points.add({"heat", 1.0f});
    write_points(folder / "a.csv", points);
    const PointSet read = read_points(folder / "a.csv");
    CHECK(read.find<Token>("name"));
    CHECK(read.find<float>("heat"));
    // Quotes around all names say nothing.
    CHECK(Files().read("b.csv", "\"Px\",\"Py\",\"Pz\",\"heat\"\n").find<float>("heat"));
}

TEST_CASE("an .obj of vertices is no line, its points come after its lines, and one of no points is empty",
          "[io][others]")
{
    Files files;
    CHECK_FALSE(files.read("a.obj", "v 1 2 3\nv 4 5 6\n").has("curve"));
    const PointSet points = files.read("a.obj", "v 1 2 3\nv 4 5 6\nv 7 8 9\nv 0 0 0\np 3\nl 1 2 \\\n 1\n");
    CHECK(values<std::int32_t>(points, "curve") == std::vector<std::int32_t>{0, 0, 0, -1});
    CHECK(points.P()[3] == Vec3f(7, 8, 9));

    const TemporaryFolder folder;
    write_points(folder / "none.obj", PointSet());
    CHECK(read_points(folder / "none.obj").empty());
    CHECK_THAT(files.error("a.obj", ""), Catch::EndsWith("is not an .obj file with vertices"));
}

TEST_CASE("whole numbers of Rapid's own attributes are floats", "[io][others]")
{
    const PointSet points = Files().read(
        "a.ply", ply_of("property int pscale\nproperty uchar life\nproperty int kind\n", "1 2 3 4 5 6\n1 2 3 7 8 9\n"));
    CHECK(values<float>(points, "pscale") == std::vector<float>{4, 7});
    CHECK(values<float>(points, "life") == std::vector<float>{5, 8});
    CHECK(values<std::int32_t>(points, "kind") == std::vector<std::int32_t>{6, 9});
}

TEST_CASE("primvars of a .usda go by their indices", "[io][others][usda]")
{
    Files files;
    const std::string head =
        "#usda 1.0\ndef Points \"p\"\n{\n    point3f[] points = [(1, 2, 3), (4, 5, 6)]\n"
        "    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)]\n"
        "    string[] primvars:kind = [\"oak\"]\n";
    const PointSet points = files.read("a.usda", head +
                                                     "    int[] primvars:displayColor:indices = [1, 0]\n"
                                                     "    int[] primvars:kind:indices = [0, 0]\n}\n");
    CHECK(values<Vec3f>(points, "Cd") == std::vector<Vec3f>{{0, 1, 0}, {1, 0, 0}});
    CHECK(points.column<Token>("kind")[1].text() == "oak");
    CHECK_FALSE(points.has("displayColor:indices"));
    CHECK_THAT(files.error("a.usda", head + "    int[] primvars:displayColor:indices = [1, 2]\n}\n"),
               Catch::EndsWith("primvars:displayColor has the index 2; there are 2 values, from 0"));
}

TEST_CASE("points of a .usda are in metres, with y up, where their prims put them", "[io][others][usda]")
{
    Files files;
    const auto world = [&](const std::string& metadata, const std::string& xform, const std::string& own) {
        return files.read("a.usda", "#usda 1.0\n(\n    doc = \"a (test)\"\n" + metadata +
                                        ")\n\ndef Xform \"World\" (\n"
                                        "    kind = \"group\"\n)\n{\n" +
                                        xform +
                                        "\n    def Scope \"s\"\n    {\n"
                                        "        def Mesh \"m\" { int[] faceVertexCounts = [3] }\n"
                                        "        def Points \"p\"\n        {\n" +
                                        own +
                                        "\n            point3f[] points = [(100, 200, 300)]\n"
                                        "            vector3f[] velocities = [(10, 20, 30)]\n"
                                        "            normal3f[] normals = [(0, 0.6, 0.8)]\n"
                                        "            float[] widths = [20]\n        }\n    }\n}\n");
    };
    const std::string move =
        "double3 xformOp:translate = (10, 0, 0)\n"
        "uniform token[] xformOpOrder = [\"xformOp:translate\"]";
    const PointSet turned = world("    metersPerUnit = 0.01\n    upAxis = \"Z\"\n", move, "");
    CHECK_THAT(turned.P()[0], close_to(Vec3f(1.1f, 3, -2), 1e-6));
    CHECK_THAT(turned.v()[0], close_to(Vec3f(0.1f, 0.3f, -0.2f), 1e-7));
    CHECK_THAT(turned.column<Vec3f>("N")[0], close_to(Vec3f(0, 0.8f, -0.6f), 1e-7));
    CHECK(turned.column<float>("pscale")[0] == Approx(0.1));

    const PointSet as_is = world("", "", "");
    CHECK(as_is.P()[0] == Vec3f(100, 200, 300));
    CHECK(as_is.column<float>("pscale")[0] == 10);

    // Scaled, turned about x and then z, moved from a pivot, and turned back by a matrix of row vectors.
    const PointSet operations =
        world("", "",
              "float3 xformOp:scale = (1, 2, 1)\nfloat3 xformOp:rotateXYZ.timeSamples = { 1: (90, 0, 90), }\n"
              "double3 xformOp:translate:pivot = (5, 0, 0)\n"
              "matrix4d xformOp:transform = ( (0, -1, 0, 0), (1, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1) )\n"
              "uniform token[] xformOpOrder = [\"xformOp:transform\", \"xformOp:translate:pivot\", "
              "\"xformOp:rotateXYZ\", \"xformOp:scale\", \"!invert!xformOp:translate:pivot\"]");
    // (95, 200, 300) -> (95, 400, 300) -> (95, -300, 400) -> (300, 95, 400) -> (305, 95, 400) -> (95, -305, 400)
    CHECK_THAT(operations.P()[0], close_to(Vec3f(95, -305, 400), 1e-4));
    CHECK_THAT(world("", move, "uniform token[] xformOpOrder = [\"!resetXformStack!\"]").P()[0],
               close_to(Vec3f(100, 200, 300), 0));
    CHECK_THAT(files.error("a.usda",
                           "#usda 1.0\ndef Points \"p\"\n{\n    point3f[] points = [(1, 2, 3)]\n"
                           "    uniform token[] xformOpOrder = [\"xformOp:scale\"]\n}\n"),
               Catch::EndsWith("line 5: xformOp:scale has no value"));
}

TEST_CASE("a .vtp of several pieces is one set, and its strings may be of signed bytes", "[io][others]")
{
    Files files;
    const auto piece = [](int n, const std::string& P, const std::string& heat, const std::string& text) {
        return "<Piece NumberOfPoints=\"" + std::to_string(n) +
               "\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">" + P +
               "</DataArray></Points><PointData><DataArray type=\"Float32\" Name=\"heat\" format=\"ascii\">" + heat +
               "</DataArray><Array type=\"String\" Name=\"kind\" format=\"ascii\">" + text +
               "</Array></PointData></Piece>";
    };
    const auto file = [](const std::string& pieces) {
        return "<VTKFile type=\"PolyData\"><PolyData>" + pieces + "</PolyData></VTKFile>";
    };
    const PointSet points = files.read("a.vtp", file(piece(1, "1 2 3", "4", "-61 -92 0") + piece(0, "", "", "") +
                                                     piece(1, "-.5 0 1e-7", "+5.", "195 164 0")));
    CHECK(values<Vec3f>(points, "P") == two);
    CHECK(values<float>(points, "heat") == std::vector<float>{4, 5});
    CHECK(points.id()[1] == 1);
    for (std::size_t i = 0; i < 2; ++i) CHECK(points.column<Token>("kind")[i].text() == "\xc3\xa4");
    CHECK_THAT(files.error("a.vtp", file(piece(1, "1 2 3", "4", "-129 0"))),
               Catch::Contains("its number 0 is not a byte"));
    CHECK_THAT(
        files.error("a.vtp", file(piece(1, "1 2 3", "4", "0") +
                                  "<Piece NumberOfPoints=\"1\"><Points><DataArray type=\"Float32\" "
                                  "NumberOfComponents=\"3\" format=\"ascii\">1 2 3</DataArray></Points></Piece>")),
        Catch::EndsWith("its pieces have different arrays; they must have the same"));
}

TEST_CASE("a legacy .vtk is read as text and binary, of old and new versions", "[io][others]")
{
    Files files;
    const std::string old =
        "# vtk DataFile Version 3.0\na title\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n1 2 3\n-.5 0 1e-7\n"
        "VERTICES 2 4\n1 0\n1 1\nCELL_DATA 2\nSCALARS cold float\nLOOKUP_TABLE default\n7 8\n"
        "POINT_DATA 2\nSCALARS id unsigned_int 1\nLOOKUP_TABLE id_table\n5 6\n"
        "VECTORS velocity double\n1 0 0\n0 1 0\nFIELD FieldData 2\na%20b 1 2 int\n3 4\n"
        "METADATA\nINFORMATION 0\n\nwet 1 2 float\n0.5 0.25\n";
    const PointSet points = files.read("a.vtk", old);
    CHECK(values<Vec3f>(points, "P") == two);
    CHECK(points.v()[1] == Vec3f(0, 1, 0));
    CHECK(points.id()[1] == 6);
    CHECK(values<std::int32_t>(points, "a b") == std::vector<std::int32_t>{3, 4});
    CHECK(values<float>(points, "wet") == std::vector<float>{0.5f, 0.25f});
    CHECK_FALSE(points.has("cold"));

    std::string binary = "# vtk DataFile Version 5.1\na title\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 float\n";
    const auto put = [&](auto number) {
        auto bytes = std::bit_cast<std::array<char, sizeof number>>(number);
        std::reverse(bytes.begin(), bytes.end());
        binary.append(bytes.data(), bytes.size());
    };
    for (const Vec3f& P : two)
        for (int axis = 0; axis < 3; ++axis) put(P[axis]);
    binary += "\nCELLS 3 2\nOFFSETS vtktypeint64\n";
    for (const std::int64_t offset : {0, 1, 2}) put(offset);
    binary += "\nCONNECTIVITY vtktypeint64\n";
    for (const std::int64_t point : {0, 1}) put(point);
    binary += "\nCELL_TYPES 2\n";
    for (const std::int32_t type : {1, 1}) put(type);
    binary += "\nPOINT_DATA 2\nSCALARS id int\nLOOKUP_TABLE default\n";
    for (const std::int32_t id : {10, 11}) put(id);
    const PointSet grid = files.read("b.vtk", binary + "\n");
    CHECK(values<Vec3f>(grid, "P") == two);
    CHECK(grid.id()[1] == 11);

    CHECK_THAT(files.error("c.vtk", binary.substr(0, binary.size() - 2)), Catch::Contains("\"id\""));
    CHECK_THAT(
        files.error("c.vtk", "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 99999999999 float\n1"),
        Catch::Contains("the file ends early: \"P\" should have 99999999999 rows"));
    CHECK_THAT(files.error("c.vtk", "# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\n"),
               Catch::Contains("it has STRUCTURED_POINTS"));
    CHECK_THAT(error_of([&] { write_points("/tmp/never.vtk", points); }),
               Catch::Contains("unknown extension \".vtk\""));
}

TEST_CASE("an .npy of shape (n, 3) is read as positions", "[io][others]")
{
    std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }";
    header.resize(118, ' ');
    std::string bytes = std::string("\x93NUMPY\1\0", 8) + static_cast<char>(header.size()) + '\0' + header;
    for (const Vec3f& P : two)
        for (int axis = 0; axis < 3; ++axis) {
            const double number = P[axis];
            bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
        }
    Files files;
    CHECK(values<Vec3f>(files.read("a.npy", bytes), "P") == two);
    CHECK_THAT(files.error("a.npy", bytes.substr(0, bytes.size() - 1)), Catch::Contains("it contains 1"));
}
