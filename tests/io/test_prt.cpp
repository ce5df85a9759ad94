#include <tbb/global_control.h>
#include <zlib.h>

#include <bit>

#include "runtime/files/scalars.h"
#include "runtime/io/format.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

template <class T>
T number_at(const std::string& text, std::size_t at)
{
    T value;
    std::memcpy(&value, text.data() + at, sizeof value);
    return value;
}

template <class T>
std::string value_bytes(T value)
{
    return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string padded(const std::string& text, std::size_t size) { return text + std::string(size - text.size(), '\0'); }

const std::string magic("\xc0PRT\r\n\x1a\n", 8);

// A file of another program: the definitions of channels, and records, compressed as one.
struct OtherFile {
    std::int32_t version = 1;
    std::int64_t points = 0;
    std::string more_header, records;
    struct Channel {
        std::string name;
        std::int32_t type, numbers, offset;
    };
    std::vector<Channel> channels;

    std::string text() const
    {
        std::string text = magic + value_bytes(static_cast<std::int32_t>(56 + more_header.size())) +
                           padded("Extensible Particle Format", 32) + value_bytes(version) + value_bytes(points) +
                           more_header + value_bytes(std::int32_t{4}) +
                           value_bytes(static_cast<std::int32_t>(channels.size())) + value_bytes(std::int32_t{44});
        for (const Channel& c : channels) {
            text += padded(c.name, 32);
            for (const std::int32_t number : {c.type, c.numbers, c.offset}) text += value_bytes(number);
        }
        std::string packed(::compressBound(records.size()), '\0');
        uLongf size = packed.size();
        ::compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(records.data()),
                   records.size());
        return text + packed.substr(0, size);
    }
};

}  // namespace

TEST_CASE("points come back from .prt with the same bits", "[io][prt]")
{
    const std::size_t size = GENERATE(0, 1, 2, 5000, 20000);
    CAPTURE(size);
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = size, .extent = 1e5f, .strings = false});

    write_points(folder / "a.prt", points);

    CHECK(differing_columns(points, read_points(folder / "a.prt")) == "");
}

TEST_CASE("a .prt has the header, the channels and the records of version 1", "[io][prt]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(2);
    points.P().write()[1] = Vec3f(1, 2, 3);
    points.v().fill(Vec3f(4, 5, 6));
    points.id().write()[0] = 7;
    points.id().write()[1] = 3000000000;
    points.add({"Cd", Vec3f(1, 1, 0.5f)});
    points.add({"kind", std::int32_t{-3}});
    points.group("hot").write()[1] = 1;

    write_points(folder / "a.prt", points);

    const std::string text = file_text(folder / "a.prt");
    CHECK(text.substr(0, 8) == magic);
    CHECK(number_at<std::int32_t>(text, 8) == 56);
    CHECK(text.substr(12, 32) == padded("Extensible Particle Format", 32));
    CHECK(number_at<std::int32_t>(text, 44) == 1);
    CHECK(number_at<std::int64_t>(text, 48) == 2);
    CHECK(number_at<std::int32_t>(text, 56) == 4);
    REQUIRE(number_at<std::int32_t>(text, 60) == 6);
    CHECK(number_at<std::int32_t>(text, 64) == 44);
    std::size_t at = 68;
    const auto channel = [&](const std::string& name, int type, int numbers, int offset) {
        CAPTURE(name);
        CHECK(text.substr(at, 32) == padded(name, 32));
        CHECK(number_at<std::int32_t>(text, at + 32) == type);
        CHECK(number_at<std::int32_t>(text, at + 36) == numbers);
        CHECK(number_at<std::int32_t>(text, at + 40) == offset);
        at += 44;
    };
    channel("Position", 4, 3, 0);
    channel("Velocity", 4, 3, 12);
    channel("ID", 2, 1, 24);
    channel("Color", 4, 3, 32);
    channel("kind", 1, 1, 44);
    channel("group_hot", 10, 1, 48);

    std::string records(2 * 49, '\0');
    uLongf size = records.size();
    REQUIRE(::uncompress(reinterpret_cast<Bytef*>(records.data()), &size,
                         reinterpret_cast<const Bytef*>(text.data() + at), text.size() - at) == Z_OK);
    REQUIRE(size == 2 * 49);
    const float expected[] = {1, 2, 3, 4, 5, 6};
    for (std::size_t i = 0; i < 6; ++i) CHECK(number_at<float>(records, 49 + 4 * i) == expected[i]);
    CHECK(number_at<std::int64_t>(records, 24) == 7);
    CHECK(number_at<std::int64_t>(records, 49 + 24) == 3000000000);
    CHECK(number_at<float>(records, 40) == 0.5f);
    CHECK(number_at<std::int32_t>(records, 44) == -3);
    CHECK(records[48] == 0);
    CHECK(records[49 + 48] == 1);
}

TEST_CASE("a .prt of another program is read: halves, doubles, a longer header, gaps; matrices are left out",
          "[io][prt]")
{
    const TemporaryFolder folder;
    OtherFile file;
    file.version = 2;
    file.points = 2;
    file.more_header = "Meta of version 1.1";
    file.channels = {{"Position", 5, 3, 8}, {"Color", 3, 3, 0}, {"Density", 4, 1, 32}, {"UV", 4, 2, 36},
                     {"Serial", 8, 1, 44},  {"Short", 0, 1, 6}, {"Matrix", 4, 17, 52}};
    for (int i = 0; i < 2; ++i) {
        // Half a and 1: 0x3800, 0x3c00; the largest half, 65504: 0x7bff.
        file.records += value_bytes<std::uint16_t>(0x3800) + value_bytes<std::uint16_t>(0x3c00) +
                        value_bytes<std::uint16_t>(0x7bff) + value_bytes<std::int16_t>(-5);
        for (const double x : {1.0, 2.0, 3.0 + i}) file.records += value_bytes(x);
        for (const float x : {0.25f, 0.75f, 0.5f}) file.records += value_bytes(x);
        file.records += value_bytes(std::uint64_t{1} << 40) + std::string(17 * 4, 'x');
    }
    folder.write("a.prt", file.text());

    const PointSet points = read_points(folder / "a.prt");

    REQUIRE(points.size() == 2);
    CHECK_THAT(points.P()[1], close_to(Vec3f(1, 2, 4), 0));
    CHECK_THAT(points.column<Vec3f>("Cd")[1], close_to(Vec3f(0.5f, 1, 65504), 0));
    CHECK(points.column<float>("Density")[0] == 0.25f);
    CHECK(points.column<float>("UV0")[0] == 0.75f);
    CHECK(points.column<float>("UV1")[0] == 0.5f);
    CHECK(points.column<std::int64_t>("Serial")[1] == std::int64_t{1} << 40);
    CHECK(points.column<std::int32_t>("Short")[0] == -5);
    CHECK_FALSE(points.has("Matrix0"));
    CHECK(points.id()[1] == 1);
}

TEST_CASE("a .prt is the same file on any number of threads", "[io][prt]")
{
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = 50000});
    std::string first;
    for (const std::size_t threads : {1, 2, 7}) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        write_points(folder / "a.prt", points);
        const std::string text = file_text(folder / "a.prt");
        if (first.empty()) first = text;
        CHECK(text == first);
    }
}

TEST_CASE("a name that .prt can't hold is an error that says what it can", "[io][prt]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(1);
    points.add({"heat:max", 0.0f});
    CHECK_THAT(error_of([&] { write_points(folder / "a.prt", points); }),
               Catch::EndsWith("the name \"heat:max\" can't be written to .prt; it must have at most 31 letters, "
                               "digits and _, and must not begin with a digit; rename the attribute or group"));
    CHECK(file_names(folder.path()).empty());
}

TEST_CASE("a damaged .prt is an error that says how", "[io][prt]")
{
    const TemporaryFolder folder;
    const auto error = [&](const std::string& text) {
        folder.write("a.prt", text);
        return error_of([&] { read_points(folder / "a.prt"); });
    };
    OtherFile file;
    file.points = 3;
    file.channels = {{"Position", 4, 3, 0}};
    file.records = std::string(24, '\0');
    CHECK_THAT(error("hello"), Catch::EndsWith("a.prt: not a .prt file"));
    CHECK_THAT(error(file.text().substr(0, 70)), Catch::EndsWith("the file ends within its header"));
    CHECK_THAT(error(file.text()),
               Catch::EndsWith("the file ends early or is damaged: its header announces 3 points, but it contains 2"));
    OtherFile unknown = file;
    unknown.channels[0].type = 11;
    CHECK_THAT(error(unknown.text()), Catch::EndsWith("the channel \"Position\" has the unknown type 11"));
    OtherFile elsewhere = file;
    elsewhere.channels[0].offset = -4;
    CHECK_THAT(error(elsewhere.text()), Catch::EndsWith("the channel \"Position\" has 3 numbers per point, at -4"));
    OtherFile placeless = file;
    placeless.channels[0].name = "Velocity";
    CHECK_THAT(error(placeless.text()), Catch::EndsWith("there is no channel Position of three floats"));
    OtherFile large = file;
    large.points = 2;
    large.channels.push_back({"Serial", 8, 1, 12});
    large.records = std::string(2 * 20, '\xff');
    CHECK_THAT(error(large.text()), Catch::EndsWith("has Serial = 18446744073709551615; it must be at most 2^63 - 1"));
    std::string checksum = [&] {
        file.points = 2;
        return file.text();
    }();
    CHECK(error(checksum).empty());
    checksum.back() ^= 1;
    CHECK_THAT(error(checksum), Catch::EndsWith("the compressed records are damaged"));
}
