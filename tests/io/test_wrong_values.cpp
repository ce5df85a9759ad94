// Values that no reader may trust, for all formats that can express them: numbers out of range for their type, counts
// beyond the file, duplicate ids. The test of each format has values that only it can express. tests/mutants has files
// damaged or truncated at random.
#include "runtime/io/compare.h"
#include "runtime/io/format.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

// Returns the error of reading a file with these bytes, without the file's name.
std::string error_in(const std::string& name, const std::string& bytes)
{
    const TemporaryFolder folder;
    folder.write(name, bytes);
    const std::string error = error_of([&] { read_points(folder / name); });
    const std::string place = (folder / name).string() + ": ";
    return error.starts_with(place) ? error.substr(place.size()) : error;
}

std::string replaced(std::string text, const std::string& from, const std::string& to)
{
    REQUIRE(from.size() == to.size());
    std::size_t count = 0;
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()), ++count)
        text.replace(at, from.size(), to);
    REQUIRE(count > 0);
    return text;
}

std::string written_bytes(const std::string& name, const PointSet& points)
{
    const TemporaryFolder folder;
    write_points(folder / name, points);
    return file_text(folder / name);
}

const std::string ply_head =
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    "property float z\nproperty ";
std::string ply(const std::string& type, const std::string& name, const std::string& value)
{
    return ply_head + type + " " + name + "\nend_header\n1 2 3 " + value + "\n";
}

std::string vtp(const std::string& type, const std::string& value, const std::string& count = "1")
{
    return "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"" + count +
           "\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">1 2 3</DataArray></Points>"
           "<PointData><DataArray type=\"" +
           type + "\" Name=\"kind\" format=\"ascii\">" + value +
           "</DataArray></PointData></Piece></PolyData></VTKFile>";
}

std::string usda(const std::string& type, const std::string& values, const std::string& name = "primvars:kind")
{
    return "#usda 1.0\ndef Points \"points\"\n{\npoint3f[] points = [(1, 2, 3), (4, 5, 6)]\n" + type + "[] " + name +
           " = [" + values + "]\n}\n";
}

}  // namespace

TEST_CASE("an id that is not a whole number is an error, in every format that can hold one", "[io][wrong]")
{
    const float id =
        GENERATE(std::numeric_limits<float>::quiet_NaN(), 0.5f, std::numeric_limits<float>::infinity(), 3e20f);
    // Gives a float attribute the name of the ids, and the ids another name.
    PointSet points;
    points.append(2);
    points.id().write()[1] = 1;
    points.add({"jd", id});
    const auto renamed = [&](const std::string& file, const std::string& ids, const std::string& others,
                             const std::string& made, const std::string& becomes) {
        return error_in(file, replaced(replaced(written_bytes(file, points), ids, others), made, becomes));
    };
    CAPTURE(id);
    using Catch::Contains;
    CHECK_THAT(renamed("a.csv", "id,", "ud,", "jd", "id"), Contains("the column id holds numbers that are not whole"));
    CHECK_THAT(renamed("a.ply", "int id\n", "int ud\n", "float jd\n", "float id\n"),
               Contains("ids must be whole numbers"));
    CHECK_THAT(renamed("a.bgeo", std::string("\0\2id", 4), std::string("\0\2ud", 4), std::string("\0\2jd", 4),
                       std::string("\0\2id", 4)),
               Contains("ids must be whole numbers"));
    CHECK_THAT(renamed("a.npz", "id.npy", "ud.npy", "jd.npy", "id.npy"), Contains("ids must be whole numbers"));
    CHECK_THAT(renamed("a.prt", std::string("ID\0", 3), std::string("UD\0", 3), std::string("jd\0", 3),
                       std::string("ID\0", 3)),
               Contains("ids must be whole numbers"));
    CHECK_THAT(renamed("a.usda", "[] ids", "[] uds", "primvars:jd", "primvars:id"),
               Contains("ids must be whole numbers"));
    CHECK_THAT(renamed("a.vtp", "Name=\"id\"", "Name=\"ud\"", "Name=\"jd\"", "Name=\"id\""),
               Contains("ids must be whole numbers"));
    CHECK_THAT(renamed("a.vdb", std::string("\2\0\0\0id", 6), std::string("\2\0\0\0ud", 6),
                       std::string("\2\0\0\0jd", 6), std::string("\2\0\0\0id", 6)),
               Contains("id"));
}

TEST_CASE("a number beyond its type is an error, in every format of text that has types", "[io][wrong]")
{
    using Catch::Contains;
    const auto [small, wide, value] =
        GENERATE(table<std::string, std::string, std::string>({{"uchar", "UInt8", "300"},
                                                               {"uchar", "UInt8", "-1"},
                                                               {"int", "Int32", "99999999999"},
                                                               {"int", "Int32", "1.5"},
                                                               {"uint", "UInt32", "4294967296"},
                                                               {"uint", "UInt32", "-1"}}));
    CAPTURE(small, value);
    CHECK_THAT(error_in("a.ply", ply(small, "kind", value)), Contains("is not a number of its type"));
    CHECK_THAT(error_in("a.vtp", vtp(wide, value)),
               Contains("the array \"kind\" of 1 rows: its number 0 is not a number of its type"));
    const std::string missing = value == "1.5" ? "line 5: ',' is missing" : "line 5: a number of its type is missing";
    CHECK_THAT(error_in("a.usda", usda(small, value + ", 1")), Contains(missing));
    CHECK_THAT(error_in("a.usda", usda(small, "1, " + value)), Contains(missing));
    // The largest and smallest values are accepted.
    CHECK(error_in("a.ply", ply("uchar", "kind", "255")) == "");
    CHECK(error_in("a.vtp", vtp("UInt8", "255")) == "");
    CHECK(error_in("a.usda", usda("uchar", "255, 0")) == "");
    CHECK(error_in("a.usda", usda("uint", "4294967295, 0")) == "");
    CHECK(error_in("a.usda", usda("int64", "9223372036854775807, -9223372036854775808")) == "");
    CHECK_THAT(error_in("a.usda", usda("uint64", "9223372036854775808, 0")),
               Contains("line 5: a number of its type is missing"));
}

TEST_CASE("numbers without what parts them are an error in .usda, and numbers beyond the count in .vtp", "[io][wrong]")
{
    CHECK_THAT(error_in("a.usda", usda("float", "1.5.25")), Catch::Contains("line 5: ',' is missing"));
    CHECK_THAT(error_in("a.usda", usda("float", "1 2")), Catch::Contains("line 5: ',' is missing"));
    CHECK(error_in("a.usda", usda("float", "1, 2,")) == "");
    CHECK_THAT(error_in("a.vtp", vtp("Float32", "1.5.25")),
               Catch::Contains("the array \"kind\" of 1 rows: its number 0 is not a number of its type"));
    CHECK_THAT(error_in("a.vtp", vtp("Float32", "1 2")), Catch::Contains("has more than its 1 numbers"));
    CHECK(error_in("a.vtp", vtp("Float32", " 1\n")) == "");
}

TEST_CASE("a count that is more than the file holds is an error, where the product overflows, too", "[io][wrong]")
{
    // 2^61 points of 8 bytes, and 2^64 - 1.
    const std::string count = GENERATE("1000000000000", "2305843009213693952", "18446744073709551615");
    CAPTURE(count);
    using Catch::Contains;
    PointSet points;
    points.append(1);
    const auto number = std::stoull(count);
    const std::string little(reinterpret_cast<const char*>(&number), sizeof number);

    const std::string one = written_bytes("a.ply", points);
    for (const std::string& text : {ply("uchar", "kind", "1"), one}) {
        std::string promising = text;
        promising.replace(promising.find("vertex 1\n"), 8, "vertex " + count);
        CHECK_THAT(error_in("a.ply", promising), Contains("the file ends early: its header announces " + count));
    }
    std::string array = written_bytes("a.npz", points);
    array = replaced(array, "(1, 3), }" + std::string(count.size() - 1, ' '), "(" + count + ", 3), }");
    CHECK_THAT(error_in("a.npz", array), Contains("P.npy"));
    std::string krakatoa = written_bytes("a.prt", points);
    krakatoa.replace(8 + 4 + 32 + 4, 8, little);
    CHECK_THAT(error_in("a.prt", krakatoa), Contains(number >> 63 ? "never completed" : "the file ends early"));
    CHECK_THAT(error_in("a.vtp", vtp("UInt8", "1", count)), Contains("the array ends early"));
    std::string raw = written_bytes("a.vtp", points);
    raw.replace(raw.find("NumberOfPoints=\"1\""), 18, "NumberOfPoints=\"" + count + "\"");
    CHECK_THAT(error_in("a.vtp", raw), Contains("the array ends early"));
    std::string houdini = written_bytes("a.bgeo", points);
    houdini.replace(9, 4, "\xff\xff\xff\xff");
    CHECK_THAT(error_in("a.bgeo", houdini), Contains("its header announces 4294967295 points, but it contains 1"));
}

TEST_CASE("a mark of the byte order loses nothing, in every format of text", "[io][wrong]")
{
    const std::string mark = "\xef\xbb\xbf";
    const PointSet points = random_points({.size = 3, .first_id = 7, .wide = false});
    for (const char* name : {"a.csv", "a.ply", "a.usda", "a.vtp", "a.obj"}) {
        CAPTURE(name);
        const TemporaryFolder folder;
        folder.write(name, mark + written_bytes(name, points));
        const PointSet marked = read_points(folder / name);
        write_points(folder / name, points);
        CHECK(differing_columns(marked, read_points(folder / name)) == "");
    }
}

TEST_CASE("points of one id are not called the same, whichever format they come from", "[io][wrong]")
{
    PointSet points = random_points({.size = 3, .first_id = 4, .wide = false});
    for (std::int64_t& id : points.id().write()) id = 4;
    for (const Format& format : formats()) {
        if (!format.read || format.positions_only) continue;
        const std::string name = "a" + format.extension;
        CAPTURE(name);
        const TemporaryFolder folder;
        write_points(folder / name, points);
        const PointSet read = read_points(folder / name);
        CHECK_THAT(error_of([&] { compare(read, read, 0); }), Catch::Contains("two points of A have the id 4"));
    }
}

TEST_CASE("two attributes of one name are an error, in every format that can hold them", "[io][wrong]")
{
    PointSet points;
    points.append(2);
    points.id().write()[1] = 1;
    points.add({"heat", 1.0f});
    points.add({"cold", 2.0f});
    const std::string message = "two columns would be called \"heat\"";
    for (const char* name : {"a.csv", "a.bgeo", "a.npz", "a.ply", "a.prt", "a.vtp"}) {
        CAPTURE(name);
        CHECK_THAT(error_in(name, replaced(written_bytes(name, points), "cold", "heat")), Catch::Contains(message));
    }
    CHECK_THAT(error_in("a.usda", replaced(written_bytes("a.usda", points), "cold", "heat")),
               Catch::Contains("primvars:heat.timeSamples appears twice"));
}
