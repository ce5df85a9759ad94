#include <fmt/format.h>
#include <zlib.h>

#include "runtime/io/format.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

template <class T>
std::string raw_bytes(std::initializer_list<T> values)
{
    return {reinterpret_cast<const char*>(values.begin()), values.size() * sizeof(T)};
}

std::string base64(const std::string& bytes)
{
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t word = 0;
        for (std::size_t b = 0; b < 3; ++b)
            word = word << 8 | (i + b < bytes.size() ? static_cast<unsigned char>(bytes[i + b]) : 0);
        for (std::size_t c = 0; c < 4; ++c) text += i + c > bytes.size() ? '=' : digits[word >> (18 - 6 * c) & 63];
    }
    return text;
}

std::string zlib(const std::string& bytes)
{
    std::string packed(::compressBound(bytes.size()), '\0');
    uLongf size = packed.size();
    ::compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
               bytes.size());
    return packed.substr(0, size);
}

// Returns a file of two points with other attributes of the root, other points, arrays, and appended data.
std::string file_of(const std::string& root, const std::string& points, const std::string& arrays = "",
                    const std::string& appended = "")
{
    return "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" " + root +
           ">\n<PolyData><Piece NumberOfPoints=\"2\"><Points><DataArray " + points +
           "</DataArray></Points><PointData>" + arrays + "</PointData></Piece></PolyData>" + appended + "</VTKFile>\n";
}

const std::string ascii_points = "type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n 0 1 2\n3 4 5e-1 ";

}  // namespace

TEST_CASE("points come back from .vtp with the same bits", "[io][vtp]")
{
    const std::size_t size = GENERATE(0, 1, 2, 5000);
    CAPTURE(size);
    const TemporaryFolder folder;
    const PointSet points = random_points({.size = size, .extent = 1e5f});

    write_points(folder / "a.vtp", points);

    CHECK(differing_columns(points, read_points(folder / "a.vtp")) == "");
}

TEST_CASE("a .vtp has the XML and the appended arrays of VTK's PolyData, and a cell of all points", "[io][vtp]")
{
    const TemporaryFolder folder;
    PointSet points;
    points.append(2);
    points.P().write()[1] = Vec3f(1, 2, 3);
    points.v().fill(Vec3f(4, 5, 6));
    points.id().write()[0] = 7;
    points.group("<hot>").write()[1] = 1;

    write_points(folder / "a.vtp", points, {.number = 12, .time = 0.5});

    const std::string text = file_text(folder / "a.vtp");
    const auto array = [](const std::string& name, const std::string& type, int numbers, int offset) {
        return fmt::format(
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\" />", type,
            name, numbers, offset);
    };
    for (const std::string& part :
         {std::string("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"),
          std::string("Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">0.5</DataArray>"),
          std::string("<Piece NumberOfPoints=\"2\" NumberOfVerts=\"1\""), array("v", "Float32", 3, 0),
          array("id", "Int64", 1, 32), array("group_&lt;hot>", "UInt8", 1, 56), array("P", "Float32", 3, 66),
          array("connectivity", "Int64", 1, 98), array("offsets", "Int64", 1, 122)}) {
        CAPTURE(part);
        CHECK(text.find(part) != std::string::npos);
    }
    const std::string data =
        raw_bytes<std::uint64_t>({24}) + raw_bytes<float>({4, 5, 6, 4, 5, 6}) + raw_bytes<std::uint64_t>({16}) +
        raw_bytes<std::int64_t>({7, -1}) + raw_bytes<std::uint64_t>({2}) + std::string("\0\1", 2) +
        raw_bytes<std::uint64_t>({24}) + raw_bytes<float>({0, 0, 0, 1, 2, 3}) + raw_bytes<std::uint64_t>({16}) +
        raw_bytes<std::int64_t>({0, 1}) + raw_bytes<std::uint64_t>({8}) + raw_bytes<std::int64_t>({2});
    const std::string begin = "<AppendedData encoding=\"raw\">_";
    const std::size_t at = text.find(begin);
    REQUIRE(at != std::string::npos);
    CHECK(text.substr(at + begin.size(), data.size()) == data);
    CHECK(text.substr(at + begin.size() + data.size()) == "</AppendedData>\n</VTKFile>\n");
}

TEST_CASE("a .vtp of another program is read: text, base64, compressed, big-endian, raw", "[io][vtp]")
{
    const TemporaryFolder folder;
    const auto read = [&](const std::string& text) {
        folder.write("a.vtp", text);
        const PointSet points = read_points(folder / "a.vtp");
        REQUIRE(points.size() == 2);
        CHECK_THAT(points.P()[1], close_to(Vec3f(3, 4, 0.5f), 0));
        return points;
    };
    const std::string three = "type=\"Float64\" NumberOfComponents=\"3\" format=\"binary\">\n";
    const std::string data = raw_bytes<double>({0, 1, 2, 3, 4, 0.5});

    const PointSet text =
        read(file_of("", ascii_points,
                     "<DataArray type=\"Int64\" Name=\"serial\" format=\"ascii\">-4 1099511627776"
                     "</DataArray><DataArray type=\"String\" Name=\"s\" format=\"ascii\">97 98 0</DataArray>"
                     "<DataArray type=\"Float32\" Name=\"m\" NumberOfComponents=\"17\" format=\"ascii\"/>"
                     "<DataArray type=\"Float32\" Name=\"uv\" NumberOfComponents=\"2\" "
                     "format=\"ascii\">1 2 3 nan</DataArray>"));
    CHECK(text.column<std::int64_t>("serial")[1] == 1099511627776);
    CHECK(text.column<float>("uv1")[0] == 2);
    CHECK(text.column_names() == std::vector<std::string>{"P", "id", "serial", "uv0", "uv1", "v"});
    CHECK(text.id()[1] == 1);

    read(file_of("", three + base64(raw_bytes<std::uint32_t>({48}) + data)));
    read(file_of("header_type=\"UInt64\"", three + base64(raw_bytes<std::uint64_t>({48}) + data)));

    // Two blocks of 40 and 8 bytes.
    const std::string first = zlib(data.substr(0, 40)), second = zlib(data.substr(40));
    const std::string header = raw_bytes<std::uint32_t>(
        {2, 40, 8, static_cast<std::uint32_t>(first.size()), static_cast<std::uint32_t>(second.size())});
    const std::string compressor = "compressor=\"vtkZLibDataCompressor\"";
    read(file_of(compressor, three + base64(header) + base64(first + second)));
    const std::string appended = "type=\"Float64\" NumberOfComponents=\"3\" format=\"appended\" offset=\"3\">";
    read(file_of(compressor, appended, "",
                 "<AppendedData encoding=\"raw\">\n _abc" + header + first + second + "</AppendedData>"));
    read(file_of(
        compressor, appended, "",
        "<AppendedData encoding=\"base64\">\n _abc" + base64(header) + base64(first + second) + "</AppendedData>"));

    std::string swapped = raw_bytes<std::uint32_t>({48}) + data;
    std::reverse(swapped.begin(), swapped.begin() + 4);
    for (int i = 0; i < 6; ++i) std::reverse(swapped.begin() + 4 + 8 * i, swapped.begin() + 12 + 8 * i);
    read(file_of("byte_order=\"BigEndian\"", three + base64(swapped)));
}

TEST_CASE("a damaged .vtp is an error that says how", "[io][vtp]")
{
    const TemporaryFolder folder;
    const auto error = [&](const std::string& text) {
        folder.write("a.vtp", text);
        return error_of([&] { read_points(folder / "a.vtp"); });
    };
    const std::string three = "type=\"Float32\" NumberOfComponents=\"3\" format=\"binary\">";
    CHECK_THAT(error("hello"), Catch::EndsWith("a.vtp: not a VTK file: it has no element VTKFile"));
    CHECK_THAT(error("<VTKFile type=\"PolyData\"><PolyData>"), Catch::Contains("its XML is damaged: "));
    CHECK_THAT(error("<VTKFile type=\"ImageData\"/>"),
               Catch::EndsWith("it contains ImageData; it must contain PolyData"));
    CHECK_THAT(error("<VTKFile type=\"PolyData\"/>"), Catch::EndsWith("the file has no piece"));
    CHECK_THAT(
        error(file_of("compressor=\"vtkLZ4DataCompressor\"", ascii_points)),
        Catch::EndsWith(
            "compressed by vtkLZ4DataCompressor; it must be compressed by vtkZLibDataCompressor, or not at all"));
    CHECK_THAT(error(file_of("", "type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 1 2 3 4")),
               Catch::EndsWith("the array \"\" of 2 rows: the array ends early"));
    CHECK_THAT(error(file_of("", "type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 1 2 3 4 five")),
               Catch::EndsWith("its number 5 is not a number of its type"));
    CHECK_THAT(error(file_of("", three + base64(raw_bytes<std::uint32_t>({20}) + std::string(20, '\0')))),
               Catch::EndsWith("the array ends early"));
    CHECK_THAT(error(file_of("", three + base64(raw_bytes<std::uint32_t>({24}) + std::string(20, '\0')))),
               Catch::EndsWith("the array ends early"));
    CHECK_THAT(error(file_of("", three + std::string(40, '*'))), Catch::EndsWith("the array is not valid base64"));
    CHECK_THAT(error(file_of("", "type=\"Int32\" NumberOfComponents=\"3\" format=\"ascii\">0 1 2 3 4 5")),
               Catch::EndsWith("its Points are not an array of three floats for each point"));
    CHECK_THAT(error(file_of("", "type=\"Float32\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\">")),
               Catch::EndsWith("the array ends early"));
    CHECK_THAT(error(file_of("compressor=\"vtkZLibDataCompressor\"",
                             three + base64(raw_bytes<std::uint32_t>({0xffffffff, 1, 1})))),
               Catch::EndsWith("the array ends early"));
}
