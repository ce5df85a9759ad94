#include "runtime/files/skipped_contents.h"
#include "runtime/io/format.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

TEST_CASE("points come back from .usda with the same bits", "[io][usda]")
{
    const std::size_t size = GENERATE(0, 1, 2, 5000);
    CAPTURE(size);
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = size, .extent = 1e5f});

    write_points(folder / "a.usda", points);

    CHECK(differing_columns(points, read_points(folder / "a.usda")) == "");
}

TEST_CASE("a .usda is a prim of points with a sample at the frame's time code, by USD's names", "[io][usda]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(2);
    points.P().write()[1] = Vec3f(1, 2.5f, -3);
    points.id().write()[1] = 3000000000;
    points.add({"Cd", Vec3f(1, 0, 0.5f)});
    points.add({"Alpha", 0.5f});
    points.add({"N", 0.25f});  // no normal
    points.add({"accel", Vec3f(0, -9, 0)});
    points.add({"orient", Quatf(1, 0, 0, 0)});
    points.add({"pscale", 0.25f});
    points.group("hot").write()[1] = 1;

    write_points(folder / "a.usda", points, {.number = 12, .fps = 25});

    CHECK(file_text(folder / "a.usda") == R"(#usda 1.0
(
    defaultPrim = "points"
    doc = "Rapid points"
    endTimeCode = 12
    framesPerSecond = 25
    metersPerUnit = 1
    startTimeCode = 12
    timeCodesPerSecond = 25
    upAxis = "Y"
)

def Points "points"
{
    float3[] extent.timeSamples = {
        12: [(-0.25, -0.25, -3.25), (1.25, 2.75, 0.25)],
    }
    point3f[] points.timeSamples = {
        12: [(0, 0, 0), (1, 2.5, -3)],
    }
    vector3f[] velocities.timeSamples = {
        12: [(0, 0, 0), (0, 0, 0)],
    }
    int64[] ids.timeSamples = {
        12: [-1, 3000000000],
    }
    float[] primvars:displayOpacity (
        interpolation = "vertex"
    )
    float[] primvars:displayOpacity.timeSamples = {
        12: [0.5, 0.5],
    }
    color3f[] primvars:displayColor (
        interpolation = "vertex"
    )
    color3f[] primvars:displayColor.timeSamples = {
        12: [(1, 0, 0.5), (1, 0, 0.5)],
    }
    float[] primvars:N (
        interpolation = "vertex"
    )
    float[] primvars:N.timeSamples = {
        12: [0.25, 0.25],
    }
    vector3f[] accelerations.timeSamples = {
        12: [(0, -9, 0), (0, -9, 0)],
    }
    quatf[] primvars:orient (
        interpolation = "vertex"
    )
    quatf[] primvars:orient.timeSamples = {
        12: [(1, 0, 0, 0), (1, 0, 0, 0)],
    }
    float[] widths.timeSamples = {
        12: [0.5, 0.5],
    }
    bool[] primvars:group_hot (
        interpolation = "vertex"
    )
    bool[] primvars:group_hot.timeSamples = {
        12: [0, 1],
    }
}
)");
}

TEST_CASE("a .usda of another program is read: defaults, constants, comments, other prims and properties", "[io][usda]")
{
    const TemporaryFolder folder;
    folder.write("a.usda", R"(#usda 1.0
( # a comment with ) and "
    doc = """several
lines, def Points "no" { }"""
    subLayers = [ @./other.usda@ ]
)
def Xform "world" (
    prepend apiSchemas = ["A"]
)
{
    double3 xformOp:translate = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Points "rain" (kind = "component")
    {
        uniform bool doubleSided = 1
        rel material:binding = </world/mat>
        point3f[] points = [(9, 9, 9)]
        point3f[] points.timeSamples = { 3.5: [(0, 1, 2), (3, 4, 5e-1)], }
        float[] widths = [0.5] ( interpolation = "constant" )
        texCoord2f[] primvars:uv = [(0, 1), (2, inf)] (
            interpolation = "vertex"
        )
        half[] primvars:heat = [1, 2]
        string[] primvars:label = ["a]", "b\""]
        matrix4d[] primvars:m = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)), ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))]
        bool[] primvars:group_wet = [false, true]
        int[] primvars:kind = [-1, 7]
        float[] primvars:blocked = None
        custom dictionary any = { string a = "}" }
        float[] undefined
        vector3f[] velocities = [(1, 0, 0), (0, 1, 0)]
        def Scope "inner"
        {
            float[] widths = [1, 2, 3]
        }
        token visibility.timeSamples = { 1: "inherited", 2: "invisible" }
    }
}
)");

    const PointSet points = read_points(folder / "a.usda");

    REQUIRE(points.size() == 2);
    CHECK_THAT(points.P()[1], close_to(Vec3f(4, 6, 3.5f), 0));  // moved by the world
    CHECK_THAT(points.v()[1], close_to(Vec3f(0, 1, 0), 0));
    CHECK(points.column<float>("pscale")[1] == 0.25f);
    CHECK(points.column<float>("uv0")[1] == 2);
    CHECK(points.column<float>("uv1")[1] == std::numeric_limits<float>::infinity());
    CHECK(points.column<float>("heat")[1] == 2);
    CHECK(points.column<std::int32_t>("kind")[1] == 7);
    CHECK(points.find_group("wet")->read()[1] == 1);
    CHECK(points.column_names() ==
          std::vector<std::string>{"P", "heat", "id", "kind", "label", "pscale", "uv0", "uv1", "v"});
    CHECK(points.column<Token>("label")[0].text() == "a]");
    CHECK(points.column<Token>("label")[1].text() == "b\"");
    CHECK(points.id()[1] == 1);
}

TEST_CASE("prims, values and metadata of a .usda may be nested 60,000 deep", "[io][usda]")
{
    const TemporaryFolder folder;
    constexpr int depth = 60000;
    const std::string open(depth, '['), close(depth, ']');
    std::string text = "#usda 1.0\n(\n    any = " + open + close + "\n)\n";
    for (int k = 0; k < depth; ++k)
        text +=
            "def Xform \"x\" {\ndouble3 xformOp:translate = (1, 0, 0)\n"
            "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
    text += "def Points \"p\" {\npoint3f[] points = [(0, 2, 0)]\nasset[] deep = " + open + close + "\n}\n";
    folder.write("a.usda", text + std::string(depth, '}'));

    CHECK_THAT(read_points(folder / "a.usda").P()[0], close_to(Vec3f(depth, 2, 0), 0));
}

TEST_CASE("a .usda that is damaged, or of more than one frame, is an error that says so", "[io][usda]")
{
    const TemporaryFolder folder;
    const auto error = [&](const std::string& text) {
        folder.write("a.usda", text);
        return error_of([&] { read_points(folder / "a.usda"); });
    };
    const std::string head = "#usda 1.0\ndef Points \"p\"\n{\n";
    CHECK_THAT(error("hello"), Catch::EndsWith("a.usda: not a USD text file: it does not begin with \"#usda\""));
    CHECK_THAT(error("#usda 1.0\ndef Mesh \"points\" {}\n"), Catch::EndsWith("there is no prim of the type Points"));
    CHECK_THAT(error(head + "}\n"), Catch::EndsWith("the prim of points has no positions of three numbers"));
    CHECK_THAT(error(head + "point3f[] points = [(0, 1, 2), (3, 4"), Catch::EndsWith("line 4: ',' is missing"));
    CHECK_THAT(error(head + "point3f[] points = [(0, 1, two)]\n}\n"),
               Catch::EndsWith("line 4: a number of its type is missing"));
    CHECK_THAT(error(head + "point3f[] points = [(0, 1, 2)]\n"),
               Catch::EndsWith("line 5: the file ends within the prim of points"));
    CHECK_THAT(error(head + "string a = \"b\n"), Catch::EndsWith("a string has no end"));
    CHECK_THAT(error(head + "token[] a = [(]]\n"), Catch::Contains("line 5: "));
    CHECK_THAT(error(head + "point3f[] points.timeSamples = { 1: [(0, 1, 2)], 2: [(1, 1, 2)] }\n}\n"),
               Catch::EndsWith("points has several time samples; give a file with one frame (usdcat can extract one)"));
    CHECK_THAT(error(head + "point3f[] points = [(0, 1, 2)]\n}\ndef Points \"q\" {}\n"),
               Catch::EndsWith("line 6: there are several prims of the type Points; there must be one"));
}

TEST_CASE("a name that .usda can't hold is an error that says what it can", "[io][usda]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(1);
    points.group("wet-ground");
    CHECK_THAT(error_of([&] { write_points(folder / "a.usda", points); }),
               Catch::EndsWith("the name \"wet-ground\" can't be written to .usda; it must consist of letters, digits "
                               "and _, and must not begin with a digit; rename the attribute or group"));
    CHECK(file_names(folder.path()).empty());
}

namespace {

const std::string metres = "#usda 1.0\n(\n    metersPerUnit = 1\n)\n", place = "point3f[] points = [(1, 2, 3)]\n",
                  moves = "double3 xformOp:translate = (1, 2, 3)\n",
                  order = "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n";

}  // namespace

TEST_CASE("the transforms of a .usda hold whatever the order of its properties and prims", "[io][usda]")
{
    const TemporaryFolder folder;
    const auto read = [&](const std::string& text) {
        folder.write("a.usda", metres + text);
        return read_points(folder / "a.usda");
    };
    const std::string points = "def Points \"p\"\n{\n" + place + "}\n";
    const auto within = [](const std::string& text) { return "def Xform \"a\"\n{\n" + text + "}\n"; };
    const Vec3f once(2, 4, 6), twice(3, 6, 9);
    CHECK(read(within(points + moves + order)).P()[0] == once);
    CHECK(read(within(order + points + moves)).P()[0] == once);
    CHECK(read(within(within(points + moves + order) + moves + order)).P()[0] == twice);
    CHECK(read("def Points \"p\"\n{\n" + order + moves + place + "}\n").P()[0] == once);
    CHECK(read(within(moves + order) + points).P()[0] == Vec3f(1, 2, 3));  // a prim beside that of the points

    const std::string reset = "uniform token[] xformOpOrder = [\"!resetXformStack!\", \"xformOp:translate\"]\n";
    CHECK(read(within(within(points + moves + reset) + moves + order)).P()[0] == once);
}

TEST_CASE("prims of a .usda that are not active are not read", "[io][usda]")
{
    const TemporaryFolder folder;
    const std::string first = "def Points \"p\" (\n    active = false\n)\n{\n" + place + "}\n";
    folder.write("a.usda", metres + first);
    CHECK_THAT(error_of([&] { read_points(folder / "a.usda"); }),
               Catch::EndsWith("there is no prim of the type Points"));
    folder.write("b.usda",
                 metres + first + "def Points \"q\" (\n    active = true\n)\n{\n" + place + moves + order + "}\n");
    CHECK(read_points(folder / "b.usda").P()[0] == Vec3f(2, 4, 6));
}

TEST_CASE("a .usda without metersPerUnit is read in metres, with a note", "[io][usda]")
{
    const TemporaryFolder folder;
    const std::string points = "def Points \"p\"\n{\n" + place + "}\n";
    folder.write("a.usda", "#usda 1.0\n" + points);
    folder.write("b.usda", metres + points);
    const SkippedContents notes;
    CHECK(read_points(folder / "b.usda").P()[0] == Vec3f(1, 2, 3));
    CHECK(notes.list().empty());
    CHECK(read_points(folder / "a.usda").P()[0] == Vec3f(1, 2, 3));
    CHECK(notes.list() ==
          std::vector<std::string>{"it does not state metersPerUnit, so its unit is taken for 1 m; give "
                                   "unit = 0.01 for centimetres"});
}
