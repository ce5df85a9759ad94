#include <bit>
#include <limits>

#include "runtime/io/format.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

TEST_CASE("points come back from .ply with the same bits", "[io][ply]")
{
    const std::size_t size = GENERATE(0, 1, 2, 5000);
    CAPTURE(size);
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = size, .extent = 1e5f, .wide = false, .strings = false});

    write_points(folder / "a.ply", points);

    CHECK(differing_columns(points, read_points(folder / "a.ply")) == "");
}

TEST_CASE("a .ply has the header and the little-endian records that its format says", "[io][ply]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(2);
    points.P().write()[1] = Vec3f(1, 2, 3);
    points.v().write()[1] = Vec3f(4, 5, 6);
    points.id().write()[0] = 7;
    points.id().write()[1] = 258;
    points.add({"heat", 0.5f});
    points.group("hot").write()[1] = 1;

    write_points(folder / "a.ply", points);

    const std::string header =
        "ply\nformat binary_little_endian 1.0\ncomment Rapid points, metres and seconds\nelement vertex 2\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property float vx\nproperty float vy\nproperty float vz\n"
        "property int id\nproperty float heat\nproperty uchar group_hot\nend_header\n";
    const std::string text = file_text(folder / "a.ply");
    REQUIRE(text.substr(0, header.size()) == header);
    constexpr std::size_t record = 6 * 4 + 4 + 4 + 1;
    REQUIRE(text.size() == header.size() + 2 * record);
    const char* second = text.data() + header.size() + record;
    float numbers[6];
    std::memcpy(numbers, second, sizeof numbers);
    for (int i = 0; i < 6; ++i) CHECK(numbers[i] == static_cast<float>(i + 1));
    CHECK(std::string(second + 24, 4) == std::string("\x02\x01\x00\x00", 4));  // 258
    CHECK(second[32] == 1);
}

TEST_CASE("a .ply has colours also as the bytes that other programs show, and Rapid reads its floats", "[io][ply]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(4);
    points.add({"Cd", Vec3f(0.5f, 0, 1)});
    points.add({"Alpha", 0.25f});
    const float nan = std::numeric_limits<float>::quiet_NaN();
    points.column<Vec3f>("Cd").write()[1] = Vec3f(-1, 7, nan);

    write_points(folder / "a.ply", points);

    const std::string text = file_text(folder / "a.ply");
    const std::string_view properties =
        "property float Alpha\nproperty float Cdx\nproperty float Cdy\nproperty float Cdz\nproperty uchar red\n"
        "property uchar green\nproperty uchar blue\nproperty uchar alpha\nend_header\n";
    const std::size_t at = text.find(properties);
    REQUIRE(at != std::string::npos);
    constexpr std::size_t record = 6 * 4 + 4 + 4 * 4 + 4;
    const std::string records = text.substr(at + properties.size());
    REQUIRE(records.size() == 4 * record);
    CHECK(records.substr(record - 4, 4) == std::string("\x80\x00\xff\x40", 4));
    CHECK(records.substr(2 * record - 4, 4) == std::string("\x00\xff\x00\x40", 4));
    CHECK(differing_columns(points, read_points(folder / "a.ply")) == "");
}

TEST_CASE("attributes with the names of other programs' colours come back from .ply", "[io][ply]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(2);
    points.add({"Cd", Vec3f(0.5f, 0, 1)});
    points.add({"Alpha", 0.25f});
    points.add({"alpha", 0.75f});
    points.add({"red", std::int32_t{7}});
    points.add({"nx", 3.0f});

    write_points(folder / "a.ply", points);

    CHECK(differing_columns(points, read_points(folder / "a.ply")) == "");
}

TEST_CASE("an ascii PLY of another program is read, with its colours and normals", "[io][ply]")
{
    const TemporaryFolder folder;
    std::ofstream(folder / "a.ply") << "ply\r\nformat ascii 1.0\r\nobj_info scanned\r\nelement vertex 2\r\n"
                                       "property double x\r\nproperty double y\r\nproperty double z\r\n"
                                       "property float nx\r\nproperty float ny\r\nproperty float nz\r\n"
                                       "property uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\n"
                                       "property short kind\r\nelement face 1\r\n"
                                       "property list uchar int vertex_indices\r\nend_header\r\n"
                                       "0.5 -1 2e3 0 1 0 255 0 51 -4\r\n1 2 3 1 0 0 0 255 0 9\r\n3 0 1 1\r\n";

    const PointSet points = read_points(folder / "a.ply");

    REQUIRE(points.size() == 2);
    CHECK_THAT(points.P()[0], close_to(Vec3f(0.5f, -1, 2000), 0));
    CHECK_THAT(points.column<Vec3f>("N")[1], close_to(Vec3f(1, 0, 0), 0));
    CHECK_THAT(points.column<Vec3f>("Cd")[0], close_to(Vec3f(1, 0, 0.2f), 1e-7));
    CHECK(points.column<std::int32_t>("kind")[0] == -4);
    CHECK(points.id()[1] == 1);
}

TEST_CASE("a big-endian PLY is read", "[io][ply]")
{
    const TemporaryFolder folder;
    std::string text =
        "ply\nformat binary_big_endian 1.0\nelement camera 1\nproperty short f\nelement vertex 1\n"
        "property float x\nproperty float y\nproperty float z\nend_header\n";
    text += std::string("\x00\x00", 2);                                           // the camera
    text += std::string("\x3f\x80\x00\x00\x40\x00\x00\x00\xc0\x40\x00\x00", 12);  // 1 2 -3
    std::ofstream(folder / "a.ply", std::ios::binary) << text;

    CHECK_THAT(read_points(folder / "a.ply").P()[0], close_to(Vec3f(1, 2, -3), 0));
}

TEST_CASE("an id beyond int32 can't be written to .ply or .bgeo, and the error names what can", "[io][ply][bgeo]")
{
    const std::string name = GENERATE("a.ply", "a.bgeo");
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = 1, .first_id = 3000000000, .wide = false});

    CHECK(error_of([&] { write_points(folder / name, points); }) ==
          (folder / name).string() +
              ": id = 3000000000 does not fit into the int32 of this format (at most 2147483647); write .vdb or .csv, "
              "which store int64");
    CHECK(file_names(folder.path()).empty());
}

TEST_CASE("a damaged .ply is an error that says how", "[io][ply]")
{
    const TemporaryFolder folder;
    const auto error = [&](const std::string& text) {
        std::ofstream(folder / "a.ply", std::ios::binary) << text;
        return error_of([&] { read_points(folder / "a.ply"); });
    };
    const std::string head = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n";
    const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
    CHECK_THAT(error("solid\n"), Catch::EndsWith("a.ply: not a PLY file: it does not begin with \"ply\""));
    CHECK_THAT(error(head + xyz), Catch::EndsWith("its header has no \"end_header\""));
    CHECK_THAT(error(head + "property quux x\nend_header\n"), Catch::EndsWith("unknown type \"quux\""));
    CHECK_THAT(error(head + "end_header\n"), Catch::EndsWith("the vertices have no x y z"));
    CHECK_THAT(
        error(head + xyz + "end_header\n" + std::string(30, '\0')),
        Catch::EndsWith("the file ends early: its header announces 3 of the element \"vertex\", but it contains 2"));
    CHECK_THAT(error("ply\nformat ascii 1.0\nelement vertex 2\n" + xyz + "end_header\n1 2 3\n4 5       \n"),
               Catch::EndsWith("vertex 1 of 2: z is missing; the file ends early or is damaged"));
    CHECK_THAT(error(head + xyz + "property float v\nend_header\n" + std::string(48, '\0')),
               Catch::EndsWith("the attribute v is float; it must be vec3"));
}

TEST_CASE("elements before the vertices of a .ply are passed over, with lists too", "[io][ply]")
{
    const TemporaryFolder folder;
    std::ofstream(folder / "a.ply") << "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n"
                                       "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                                       "end_header\n3 0 0 0\n1 2 3\n";
    CHECK_THAT(read_points(folder / "a.ply").P()[0], close_to(Vec3f(1, 2, 3), 0));
}
