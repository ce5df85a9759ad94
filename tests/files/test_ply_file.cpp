#include "runtime/files/ply_file.h"

#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

const std::string three_numbers = "property float x\nproperty uchar kind\nproperty int mark\n";

std::string ascii(const std::string& body)
{
    return "ply\nformat ascii 1.0\nelement vertex 2\n" + three_numbers + "end_header\n" + body;
}

// Returns the error of reading the first element.
std::string error_in(const std::string& text)
{
    return error_of([&] {
        PlyFile file(text);
        file.read_records(file.elements().at(0));
    });
}

std::vector<std::vector<std::int64_t>> lists_of(const std::string& text)
{
    PlyFile file(text);
    std::vector<std::vector<std::int64_t>> lists;
    file.read_lists(file.elements().at(0), 1,
                    [&](std::span<const std::int64_t> list) { lists.emplace_back(list.begin(), list.end()); });
    return lists;
}

}  // namespace

TEST_CASE("numbers of an ascii PLY must be of their type, and end", "[files][ply]")
{
    CHECK(error_in(ascii("1.5 255 -7\n2e3 0 2147483647\n")).empty());
    CHECK(error_in(ascii("1.5 300 -7\n2 0 1\n")) == "vertex 0 of 2: kind = 300 is not a number of its type");
    CHECK(error_in(ascii("1.5 1 -7\n2 0 99999999999\n")) ==
          "vertex 1 of 2: mark = 99999999999 is not a number of its type");
    CHECK(error_in(ascii("1.5 nan -7\n2 0 1\n")) == "vertex 0 of 2: kind = nan is not a number of its type");
    CHECK(error_in(ascii("1.5 0.5 -7\n2 0 1\n")) == "vertex 0 of 2: kind = 0.5 is not a number of its type");
    CHECK(error_in(ascii("1.5 1-7 1\n2 0 1\n")) == "vertex 0 of 2: kind = 1 is not a number of its type");
    CHECK(error_in(ascii("+1.5 1 -7\n-.5 +0 1")).empty());
    CHECK(error_in(ascii("1.5 +-1 -7\n2 0 1\n")) ==
          "vertex 0 of 2: kind is missing; the file ends early or is damaged");
    CHECK(error_in(ascii("1.5 1 -7\n2 0    \n")) ==
          "vertex 1 of 2: mark is missing; the file ends early or is damaged");
}

TEST_CASE("a PLY that ends with a number is known to be maybe cut, and its header may end lines with CR",
          "[files][ply]")
{
    for (const auto& [text, cut] : {std::pair(ascii("1.5 1 -7\n2 0 1"), true), {ascii("1.5 1 -7\n2 0 1 "), false}}) {
        PlyFile file(text);
        file.read_records(file.elements().at(0));
        CHECK(file.ends_within_number() == cut);
    }
    std::string old = ascii("1.5 1 -7\n2 0 1\n");
    std::replace(old.begin(), old.end(), '\n', '\r');
    CHECK(error_in(old).empty());
}

TEST_CASE("the sizes in a PLY header are checked before memory is allocated", "[files][ply]")
{
    const auto promising = [](const std::string& format, const std::string& count) {
        return "ply\nformat " + format + " 1.0\nelement vertex " + count + "\n" + three_numbers + "end_header\n";
    };
    const std::string count = GENERATE("3", "1000000000", "18446744073709551615", "2049638230412172402");
    const std::string message =
        "the file ends early: its header announces " + count + " of the element \"vertex\", but it contains 2";
    CHECK(error_in(promising("binary_little_endian", count) + std::string(18, '\0')) == message);
    CHECK(error_in(promising("ascii", count) + "1 2 3 4 5 6\n") == message);
    CHECK_THAT(error_of([&] { PlyFile file(promising("ascii", "99999999999999999999")); }),
               Catch::EndsWith("line 3 of its header can't be understood"));
}

TEST_CASE("lists are read between other properties, in any encoding, and are not longer than the file", "[files][ply]")
{
    const auto header = [](const std::string& format, const std::string& count_type = "uchar") {
        return "ply\nformat " + format + " 1.0\nelement face 2\nproperty short a\nproperty list " + count_type +
               " int vertex_indices\nproperty uchar b\nend_header\n";
    };
    const std::vector<std::vector<std::int64_t>> expected = {{1, -2}, {}};
    CHECK(lists_of(header("ascii") + "7 2 1 -2 3\n8 0 4\n") == expected);
    const std::string little("\x07\x00\x02\x01\x00\x00\x00\xfe\xff\xff\xff\x03\x08\x00\x00\x04", 16);
    CHECK(lists_of(header("binary_little_endian") + little) == expected);
    const std::string big("\x00\x07\x02\x00\x00\x00\x01\xff\xff\xff\xfe\x03\x00\x08\x00\x04", 16);
    CHECK(lists_of(header("binary_big_endian") + big) == expected);

    CHECK(error_of([&] { lists_of(header("ascii", "int") + "7 1000000000 1 -2 3\n8 0 4\n"); }) ==
          "face 0 of 2: a list of 1000000000 numbers is longer than the file");
    CHECK(error_of([&] { lists_of(header("ascii", "int") + "7 -1 1 -2 3\n8 0 4\n"); }) ==
          "face 0 of 2: a list of -1 numbers is longer than the file");
    CHECK(error_of([&] { lists_of(header("binary_little_endian") + little.substr(0, 15)); }) ==
          "the file ends within face 1 of 2");
}
