// Trails and curves as lines of .bgeo, .ply and .obj.
#include <fmt/format.h>

#include <fstream>

#include "runtime/files/skipped_contents.h"
#include "runtime/io/format.h"
#include "runtime/points/trail.h"
#include "tests/io/points_with_trails.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

// 0 0 0 -1 2 2 -1: two lines, of three points and of two.
PointSet with_curves()
{
    PointSet points = random_points({.size = 7, .wide = false, .strings = false});
    const std::vector<std::int32_t> curves = {0, 0, 0, -1, 2, 2, -1};
    points.set(curve_attribute, Column<std::int32_t>(std::span<const std::int32_t>(curves)));
    return points;
}

class BigEndian {
public:
    BigEndian(const std::string& text, std::size_t at) : text_(text), at_(at) {}
    std::uint32_t take(std::size_t size)
    {
        std::uint32_t value = 0;
        for (; size > 0; --size) value = value << 8 | static_cast<unsigned char>(text_.at(at_++));
        return value;
    }

private:
    const std::string& text_;
    std::size_t at_;
};

}  // namespace

TEST_CASE("the lines of trails go from each point backwards, and the set comes back from them", "[io][lines]")
{
    const PointSet points = points_with_trails(9);
    const PointLines lines = with_lines(points);
    CHECK(lines.sizes == std::vector<std::uint32_t>{2, 3, 4, 2, 3, 4});
    REQUIRE(lines.points.size() == 9 + 1 + 2 + 3 + 1 + 2 + 3);
    const std::vector<std::uint32_t> first_three = {1, 9, 2, 10, 11, 3, 12, 13, 14};
    for (std::size_t k = 0; k < first_three.size(); ++k) CHECK(lines.vertices[k] == first_three[k]);
    CHECK(lines.points.P()[14] == points.column<Vec3f>("trail3")[3]);
    CHECK(lines.points.column<Vec3f>("Cd")[14] == points.column<Vec3f>("Cd")[3]);
    CHECK(lines.points.id()[14] == points.id()[3]);
    CHECK(differing_columns(without_trail_places(lines.points), points) == "");
    CHECK(with_lines(points.select({})).sizes.empty());
}

TEST_CASE("points with trails come back from .bgeo and .ply with the same bits", "[io][lines]")
{
    const std::size_t size = GENERATE(0, 1, 2, 500, 40000);  // with fewer and with more than 65,536 positions
    const std::string extension = GENERATE(".bgeo", ".ply");
    CAPTURE(size, extension);
    const TemporaryFolder folder;
    const PointSet points = points_with_trails(size);
    const SkippedContents skipped;
    write_points(folder / ("a" + extension), points);
    CHECK(differing_columns(points, read_points(folder / ("a" + extension))) == "");
    CHECK(skipped.list().empty());
}

TEST_CASE("a .bgeo has open polygons after its points", "[io][lines][bgeo]")
{
    const TemporaryFolder folder;
    const PointSet points = with_curves();
    write_points(folder / "a.bgeo", points);
    const std::string text = file_text(folder / "a.bgeo");
    BigEndian header(text, 5);
    const std::vector<std::uint32_t> counts = {5, 7, /*primitives*/ 2, /*groups*/ 3};
    for (const std::uint32_t count : counts) CHECK(header.take(4) == count);

    // After the primitives: the groups all, hot and nobody, each a length, its name, a count and a word; the end.
    const std::size_t groups = 3 * (2 + 4 + 4) + 3 + 3 + 6 + 2, primitives = 2 * (4 + 4 + 1) + 5 * 2;
    BigEndian reader(text, text.size() - groups - primitives);
    const std::vector<std::vector<std::uint32_t>> lines = {{0, 1, 2}, {4, 5}};
    for (const std::vector<std::uint32_t>& line : lines) {
        CHECK(reader.take(4) == 1);
        CHECK(reader.take(4) == line.size());
        CHECK(reader.take(1) == ':');
        for (const std::uint32_t index : line) CHECK(reader.take(2) == index);
    }
}

TEST_CASE("polylines of a .bgeo are read in their order, with the number of the line", "[io][lines][bgeo]")
{
    const TemporaryFolder folder;
    std::string text = "BgeoV";
    const auto put = [&](std::uint32_t value, int size) {
        for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) text += static_cast<char>(value >> shift & 0xff);
    };
    // Five points; a run of an open and a closed polygon, and one more, with a float for each vertex and polygon.
    for (const std::uint32_t count : {5, 5, 3, 0, 0, 0, 1, 1, 0}) put(count, 4);
    for (int i = 0; i < 5; ++i)
        for (const float number : {float(i), 0.0f, 0.0f, 1.0f}) put(std::bit_cast<std::uint32_t>(number), 4);
    for (const std::string name : {"u", "w"}) {
        put(1, 2);
        text += name;
        put(1, 2);
        put(0, 4);
        put(0, 4);
    }
    const auto polygon = [&](char mark, const std::vector<std::uint32_t>& indices) {
        put(static_cast<std::uint32_t>(indices.size()), 4);
        text += mark;
        for (const std::uint32_t index : indices) put(index, 2), put(0, 4);
        put(0, 4);
    };
    put(0xffffffff, 4);
    put(2, 2);
    put(1, 4);
    polygon(':', {4, 2, 0});
    polygon('<', {0, 1, 2});
    put(1, 4);
    polygon(':', {2, 1});
    put(0x00ff, 2);
    const auto read = [&](const std::string& bytes) {
        std::ofstream(folder / "a.bgeo", std::ios::binary) << bytes;
        return read_points(folder / "a.bgeo");
    };

    const SkippedContents skipped;
    const PointSet points = read(text);
    REQUIRE(points.size() == 6);  // the third point is on both lines, the fourth on none
    const std::vector<std::pair<float, std::int32_t>> expected = {{4, 0}, {2, 0}, {0, 0}, {2, 1}, {1, 1}, {3, -1}};
    for (std::size_t i = 0; i < 6; ++i) {
        CHECK(points.P()[i].x() == expected[i].first);
        CHECK(points.column<std::int32_t>("curve")[i] == expected[i].second);
    }
    const std::vector<std::string> reported = skipped.list();
    CHECK(std::count(reported.begin(), reported.end(), "not read: its 1 closed polygons") == 1);

    std::string wrong = text;
    wrong[text.size() - 2 - 4 - 4 - 1] = 9;  // the last index
    CHECK_THAT(error_of([&] { read(wrong); }), Catch::EndsWith("a polygon uses point 9 of 5"));
    CHECK_THAT(error_of([&] { read(text.substr(0, text.size() - 8)); }),
               Catch::EndsWith("the file ends within its primitives"));

    const std::size_t type = text.size() - 2 - (4 + 1 + 2 * (2 + 4) + 4) - 4;
    wrong = text;
    wrong[type + 3] = 2;  // a NURBS curve
    const SkippedContents others;
    CHECK(read(wrong).size() == 5);
    const std::vector<std::string> of_others = others.list();
    CHECK(std::count(of_others.begin(), of_others.end(), "not read: its 3 primitives") == 1);
}

TEST_CASE("a .ply has an edge between each two neighbours on a line", "[io][lines]")
{
    const TemporaryFolder folder;
    write_points(folder / "a.ply", with_curves());
    const std::string text = file_text(folder / "a.ply");
    CHECK_THAT(text, Catch::Contains("element edge 3\nproperty int vertex1\nproperty int vertex2\nend_header\n"));
    const std::string edges = text.substr(text.size() - 3 * 8);
    const std::vector<int> expected = {0, 1, 1, 2, 4, 5};
    for (std::size_t k = 0; k < expected.size(); ++k) CHECK(edges[4 * k] == expected[k]);
}

TEST_CASE("an .obj has a line through each curve, and the other points", "[io][lines]")
{
    const TemporaryFolder folder;
    write_points(folder / "a.obj", with_curves());
    CHECK_THAT(file_text(folder / "a.obj"), Catch::EndsWith("\np 4 7\nl 1 2 3\nl 5 6\n"));
    write_points(folder / "b.obj", points_with_trails(3));
    CHECK_THAT(file_text(folder / "b.obj"), Catch::EndsWith("\np 1\nl 2 4\nl 3 5 6\n"));
}
