#include "runtime/io/format.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

std::uint32_t big_endian(const std::string& text, std::size_t at, std::size_t size)
{
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value = value << 8 | static_cast<unsigned char>(text.at(at + i));
    return value;
}

float big_endian_float(const std::string& text, std::size_t at)
{
    return std::bit_cast<float>(big_endian(text, at, 4));
}

}  // namespace

TEST_CASE("points come back from .bgeo with the same bits", "[io][bgeo]")
{
    const std::size_t size = GENERATE(0, 1, 2, 5000);
    CAPTURE(size);
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = size, .extent = 1e5f, .wide = false});

    write_points(folder / "a.bgeo", points);

    CHECK(differing_columns(points, read_points(folder / "a.bgeo")) == "");
}

TEST_CASE("a .bgeo has the header, attributes and big-endian records of version 5", "[io][bgeo]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(2);
    points.P().write()[1] = Vec3f(1, 2, 3);
    points.v().fill(Vec3f(4, 5, 6));
    points.id().write()[0] = 7;
    points.id().write()[1] = 258;
    points.add({"Cd", Vec3f(1, 1, 1)});
    points.group("hot").write()[1] = 1;

    write_points(folder / "a.bgeo", points);

    const std::string text = file_text(folder / "a.bgeo");
    CHECK(text.substr(0, 5) == "BgeoV");
    const std::vector<std::uint32_t> counts = {5, 2, 0, /*groups*/ 1, 0, /*attributes*/ 3, 0, 0, 0};
    for (std::size_t i = 0; i < counts.size(); ++i) CHECK(big_endian(text, 5 + 4 * i, 4) == counts[i]);

    std::size_t at = 5 + 9 * 4;
    const auto attribute = [&](const std::string& name, std::uint32_t size, std::uint32_t type) {
        CAPTURE(name);
        CHECK(big_endian(text, at, 2) == name.size());
        CHECK(text.substr(at + 2, name.size()) == name);
        at += 2 + name.size();
        CHECK(big_endian(text, at, 2) == size);
        CHECK(big_endian(text, at + 2, 4) == type);
        at += 6 + 4 * size;
    };
    attribute("v", 3, 5);
    attribute("id", 1, 1);
    attribute("Cd", 3, 0);

    constexpr std::size_t record = 4 * (4 + 3 + 1 + 3), group = 2 + 3 + 4 + 4;
    REQUIRE(text.size() == at + 2 * record + group + 2);
    at += record;
    const float expected[] = {1, 2, 3, 1, 4, 5, 6};
    for (std::size_t i = 0; i < 7; ++i) CHECK(big_endian_float(text, at + 4 * i) == expected[i]);
    CHECK(big_endian(text, at + 28, 4) == 258);
    at += record;
    CHECK(big_endian(text, at, 2) == 3);
    CHECK(text.substr(at + 2, 3) == "hot");
    CHECK(big_endian(text, at + 5, 4) == 2);
    CHECK(big_endian(text, at + 9, 4) == 0b10);  // the second point
    CHECK(text.substr(at + group) == std::string("\x00\xff", 2));
}

TEST_CASE("a .bgeo of another program is read: texts by their table, odd sizes become single numbers", "[io][bgeo]")
{
    const TemporaryFolder folder;
    std::string text = "BgeoV";
    const auto put = [&](std::uint32_t value, int size) {
        for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) text += static_cast<char>(value >> shift & 0xff);
    };
    const auto name = [&](const std::string& s) {
        put(static_cast<std::uint32_t>(s.size()), 2);
        text += s;
    };
    for (const std::uint32_t count : {5, 1, 0, 0, 0, 2, 0, 0, 0}) put(count, 4);
    name("uv");
    put(2, 2);
    put(0, 4);
    put(0, 4);
    put(0, 4);
    name("label");  // an index into a table of two strings
    put(1, 2);
    put(4, 4);
    put(2, 4);
    name("stone");
    name("wood");
    for (const float number : {1.0f, 2.0f, 3.0f, 1.0f, 0.25f, 0.75f}) put(std::bit_cast<std::uint32_t>(number), 4);
    put(1, 4);
    put(0x00ff, 2);
    std::ofstream(folder / "a.bgeo", std::ios::binary) << text;

    const PointSet points = read_points(folder / "a.bgeo");

    REQUIRE(points.size() == 1);
    CHECK_THAT(points.P()[0], close_to(Vec3f(1, 2, 3), 0));
    CHECK(points.column<float>("uv0")[0] == 0.25f);
    CHECK(points.column<float>("uv1")[0] == 0.75f);
    CHECK(points.column<Token>("label")[0].text() == "wood");
    CHECK(points.id()[0] == 0);
}

TEST_CASE("groups of a .bgeo are read after detail attributes, in words of 32, ordered or not", "[io][bgeo]")
{
    const TemporaryFolder folder;
    std::string text = "BgeoV";
    const auto put = [&](std::uint32_t value, int size) {
        for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) text += static_cast<char>(value >> shift & 0xff);
    };
    const auto name = [&](const std::string& s) {
        put(static_cast<std::uint32_t>(s.size()), 2);
        text += s;
    };
    for (const std::uint32_t count : {5, 34, 0, 2, 0, 0, 0, 0, 1}) put(count, 4);
    for (int i = 0; i < 34; ++i)
        for (const float number : {float(i), 0.0f, 0.0f, 1.0f}) put(std::bit_cast<std::uint32_t>(number), 4);
    name("scale");  // a detail value: its declaration, then its value
    put(1, 2);
    put(0, 4);
    put(0, 4);
    put(std::bit_cast<std::uint32_t>(2.0f), 4);
    put(1, 1);
    name("chosen");
    put(34, 4);
    put(1u << 31, 4);
    put(1u << 1, 4);
    put(2, 4);  // two of them, in this order; the second on a curve
    put(33, 4);
    put(static_cast<std::uint32_t>(-31 - 1), 4);
    put(0, 4);
    name("none");
    for (const std::uint32_t word : {34, 0, 0}) put(word, 4);
    put(0x00ff, 2);
    const auto read = [&](const std::string& bytes) {
        std::ofstream(folder / "a.bgeo", std::ios::binary) << bytes;
        return read_points(folder / "a.bgeo");
    };

    const PointSet points = read(text);

    CHECK(points.group_names() == std::vector<std::string>{"chosen", "none"});
    for (std::size_t i = 0; i < 34; ++i) {
        CHECK(points.find_group("chosen")->read()[i] == (i == 31 || i == 33));
        CHECK(points.find_group("none")->read()[i] == 0);
    }
    CHECK_THAT(error_of([&] { read(text.substr(0, text.size() - 3)); }),
               Catch::EndsWith("the file ends within its groups"));
    text[text.size() - 11] = 33;
    CHECK_THAT(error_of([&] { read(text); }), Catch::EndsWith("the group \"none\" has 33 points, but the file has 34"));
}

TEST_CASE("a .bgeo that is cut off, newer or something else is an error that says so", "[io][bgeo]")
{
    const TemporaryFolder folder;
    write_points(folder / "a.bgeo", random_points({.size = 3, .wide = false}));
    const std::string whole = file_text(folder / "a.bgeo");
    const auto error = [&](const std::string& text) {
        std::ofstream(folder / "b.bgeo", std::ios::binary) << text;
        return error_of([&] { read_points(folder / "b.bgeo"); });
    };
    // The groups all, hot and nobody: a length, the name, a count and a word each.
    constexpr std::size_t after_points = 3 * (2 + 4 + 4) + 3 + 3 + 6 + 2;
    CHECK_THAT(error(whole.substr(0, whole.size() - after_points - 20)),
               Catch::EndsWith("the file ends early: its header announces 3 points, but it contains 2"));
    CHECK_THAT(error(whole.substr(0, 60)), Catch::EndsWith("the file ends within its header"));
    CHECK_THAT(error("\x7fNSJb..."), Catch::EndsWith("Rapid reads the classic one (in Houdini: .bhclassic)"));
    CHECK_THAT(error("hello"), Catch::EndsWith("b.bgeo: not a classic bgeo file"));
    CHECK_THAT(error(""), Catch::EndsWith("b.bgeo: not a classic bgeo file"));
}
