#include <tbb/global_control.h>

#include "runtime/io/format.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

TEST_CASE("a .csv has the columns and the 9 digits that the command line promises, in order of id", "[io][csv]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(3);
    points.P().write()[0] = Vec3f(0.1f, -2, 1e-20f);
    points.P().write()[2] = Vec3f(1.0f / 3, 123456.789f, 1e10f);
    points.id().write()[0] = 12;
    points.id().write()[1] = 9000000000;
    points.id().write()[2] = 3;
    points.add({"heat", 0.5f});
    points.add({"Cd", Vec3f(1, 0, 0)});
    points.add({"orient", Quatf(1, 0, 0, 0.5f)});
    points.add({"hits", std::int32_t{-4}});
    points.group("old").write()[1] = 1;

    write_points(folder / "a.csv", points);

    CHECK(file_text(folder / "a.csv") ==
          "id,Px,Py,Pz,vx,vy,vz,Cdx,Cdy,Cdz,heat,hits,orientx,orienty,orientz,orientw,group:old\n"
          "3,0.333333343,123456.789,1e+10,0,0,0,1,0,0,0.5,-4,0,0,0.5,1,0\n"
          "12,0.100000001,-2,9.99999968e-21,0,0,0,1,0,0,0.5,-4,0,0,0.5,1,0\n"
          "9000000000,0,0,0,0,0,0,1,0,0,0.5,-4,0,0,0.5,1,1\n");
}

TEST_CASE("points come back from .csv with the same bits", "[io][csv]")
{
    const std::size_t size = GENERATE(0, 1, 2, 5000, 20000);
    const float extent = GENERATE(1e-3f, 1e5f);
    CAPTURE(size, extent);
    const TemporaryFolder folder;
    PointSet points = random_points({.size = size, .extent = extent, .first_id = std::int64_t{1} << 50});
    if (size == 0) {  // an empty table does not show that these are integers
        points.remove("hitnum");
        points.remove("serial");
    }

    write_points(folder / "a.csv", points);

    if (size > 2) CHECK(differing_columns(points, read_points(folder / "a.csv")) == "");
    // In one or two rows a random int32 may be exact as a float.
    points.remove(points.has("hitnum") ? "hitnum" : "none");
    PointSet read = read_points(folder / "a.csv");
    read.remove("hitnum");
    CHECK(differing_columns(points, read) == "");
}

TEST_CASE("the bytes of a .csv do not depend on the number of threads", "[io][csv]")
{
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = 30000});
    std::string first;
    for (const int threads : {1, 2, 7}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        write_points(folder / "a.csv", points);
        const std::string bytes = file_text(folder / "a.csv");
        if (first.empty()) first = bytes;
        CHECK((bytes == first));
    }
}

TEST_CASE("a .csv with infinities, NaN, CRLF and no ids is read", "[io][csv]")
{
    const TemporaryFolder folder;
    std::ofstream(folder / "a.csv", std::ios::binary) << "Px,Py,Pz,heat\r\n1,2,3,inf\r\n4,5,6,-nan\r\n\r\n";

    const PointSet points = read_points(folder / "a.csv");

    REQUIRE(points.size() == 2);
    CHECK_THAT(points.P()[1], close_to(Vec3f(4, 5, 6), 0));
    CHECK(std::isinf(points.column<float>("heat")[0]));
    CHECK(std::isnan(points.column<float>("heat")[1]));
    CHECK(points.id()[1] == 1);
}

TEST_CASE("a .csv that can't be understood is an error that names the line", "[io][csv]")
{
    const TemporaryFolder folder;
    const auto error = [&](const std::string& text) {
        std::ofstream(folder / "a.csv", std::ios::binary) << text;
        return error_of([&] { read_points(folder / "a.csv"); });
    };
    CHECK_THAT(error("Px,Py,Pz\n1,2,3\n1,2\n"), Catch::EndsWith("line 3: there are 2 values; there must be 3"));
    CHECK_THAT(error("Px,Py,Pz\n1,2,x\n"), Catch::EndsWith("line 2: Pz is not a number"));
    CHECK_THAT(error("Px,Py,Pz\n1,2,3,4\n"), Catch::EndsWith("line 2: the text after 3 values can't be parsed"));
    CHECK_THAT(error("a,b,c\n"), Catch::EndsWith("line 1: there are no columns Px,Py,Pz; the first line must name the "
                                                 "columns"));
    CHECK_THAT(error("Px,Py,Pz,id\n1,2,3,1.0\n1,2,3,0.5\n"),
               Catch::EndsWith("line 3: the column id holds numbers that are not whole: 0.5"));
    CHECK_THAT(error("Px,Py,\"Pz\n1,2,3\n"), Catch::EndsWith("line 1: a name has no closing quote"));
    CHECK(error("Px,Py,Pz\n1,2,3\n4,5,6\n") == "");
    CHECK_THAT(error("idx,idy,idz,Px,Py,Pz\n1,2,3,1,2,3\n"), Catch::EndsWith("is vec3; it must be int64"));
}

TEST_CASE("a .csv of another program has strings with or without quotes, by its first line", "[io][csv]")
{
    const TemporaryFolder folder;
    std::ofstream(folder / "a.csv", std::ios::binary) << "name,Px,Py,Pz,kind,heat\r\nleaf,1,2,3,\"a, \"\"b\"\"\",1\r\n"
                                                         "\"two\nlines\",4,5,6,7,2\r\n,7,8,9,,3\r\n";

    const PointSet points = read_points(folder / "a.csv");

    REQUIRE(points.size() == 3);
    const auto text = [&](const char* name, std::size_t i) { return points.column<Token>(name)[i].text(); };
    CHECK(text("name", 0) == "leaf");
    CHECK(text("name", 1) == "two\nlines");
    CHECK(text("name", 2) == "");
    CHECK(text("kind", 0) == "a, \"b\"");
    CHECK(text("kind", 1) == "7");
    CHECK(points.column<float>("heat")[2] == 3);
}

TEST_CASE("attributes whose columns would have one name can't be written to .csv or .ply", "[io][csv][ply]")
{
    const TemporaryFolder folder;
    PointSet points = random_points({.size = 2, .wide = false});
    points.add({"vx", 1.0f});
    for (const char* name : {"a.csv", "a.ply"})
        CHECK_THAT(error_of([&] { write_points(folder / name, points); }),
                   Catch::EndsWith("two columns would be called \"vx\"; rename one of the attributes"));
    points.remove("vx");
    points.group("a,b c");
    CHECK_THAT(error_of([&] { write_points(folder / "a.csv", points); }), Catch::Contains("\"group:a,b c\""));
    CHECK_THAT(error_of([&] { write_points(folder / "a.ply", points); }), Catch::Contains("\"group_a,b c\""));
}
