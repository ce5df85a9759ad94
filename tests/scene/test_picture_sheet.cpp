// Contact sheets of pictures: their layout, missing pictures, and files that are not pictures.
#include "bindings/scene/picture_sheet.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains;
using test::good;

// The size of a .png from its header: big-endian after the first 16 bytes.
struct Size {
    int width, height;
};
Size size_of(const std::string& png)
{
    REQUIRE(png.substr(1, 3) == "PNG");
    const auto number = [&](std::size_t at) {
        int value = 0;
        for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<unsigned char>(png[i]);
        return value;
    };
    return {number(16), number(20)};
}

}  // namespace

TEST_CASE("a sheet has a row for each series, with labels and gaps", "[picture]")
{
    const test::TemporaryFolder folder;
    Scene scene = test::opened(
        "local rapid = require 'rapid' return rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } } :solve "
        "{}");
    const SceneFrame frame = good(scene.advance());
    const std::string picture = folder.write("a.png", good(scene.picture(frame, {160, 90})));

    const Size one = size_of(good(picture_sheet({{picture, {"a"}}})));
    CHECK(one.width > 160 / 2);
    const std::string two_in_series = good(picture_sheet({{picture, {"a"}}, {picture, {"b"}}}, 2));
    const Size row = size_of(two_in_series);
    const Size four = size_of(good(picture_sheet({{picture, {"a"}}, {"", {"b"}}, {picture, {"c"}}, {"", {"d"}}}, 2)));
    CHECK(four.width == row.width);
    CHECK(four.height > row.height);
    CHECK(four.height < 2 * row.height);  // each has a margin above
    CHECK(good(picture_sheet({{picture, {"a"}}, {"", {"b"}}}, 2)) != two_in_series);
    CHECK(good(picture_sheet({{picture, {"a"}}, {picture, {"c"}}}, 2)) != two_in_series);
}

TEST_CASE("a sheet of no pictures, and of files that are none, is refused", "[picture]")
{
    const test::TemporaryFolder folder;
    const std::string text = folder.write("a.png", "no picture");
    const auto fault = [](const std::vector<SheetPicture>& pictures, std::size_t series) {
        const Result<std::string> sheet = picture_sheet(pictures, series);
        REQUIRE_FALSE(sheet);
        CHECK(sheet.error().kind == SceneError::WrongCall);
        return sheet.error().text();
    };
    CHECK_THAT(fault({}, 1), Contains("no pictures"));
    CHECK_THAT(fault({{"", {}}}, 0), Contains("series = 0"));
    CHECK_THAT(fault({{text, {}}}, 1), Contains(text));
    CHECK_THAT(fault({{folder / "b.png", {}}}, 1), Contains("b.png"));
}

}  // namespace rapid
