// Films of frames.
#include <cmath>

#include "bindings/scene/scene_film.h"
#include "include/rapid/scene.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains, Catch::StartsWith;
using test::good;

}  // namespace

TEST_CASE("a film that can't be is refused before its first picture", "[film]")
{
    const test::TemporaryFolder folder;
    const auto fault = [&](const std::string& name, const FilmOptions& options = {}) {
        const auto film = SceneFilm::begin(folder / name, options);
        REQUIRE_FALSE(film);
        CHECK(film.error().kind == SceneError::WrongCall);
        return film.error().message;
    };
    CHECK(fault("film.avi") == "a film can't be a \".avi\"; it must be .mp4, .webm or .gif");
    CHECK_THAT(fault("film.####.gif"), Contains("is a pattern for several"));
    CHECK_THAT(fault("film_{output}.gif"), Contains("is a pattern for several"));
    CHECK(fault("film.gif", {0, {64, 48}, {}}) == "0 frames per second; a film can have from 1 to 1000");
    CHECK(fault("film.gif", {std::nan(""), {64, 48}, {}}) == "nan frames per second; a film can have from 1 to 1000");
    CHECK_THAT(fault("film.gif", {24, {0, 48}, {}}), Contains("each side must be from 1 to 16384 pixels"));
    CHECK(fault("film.mp4", {24, {63, 48}, {}}) == "a .mp4 film of 63 x 48 can't be made; both edges must be even");
}

TEST_CASE("a film has its name when it is finished, and is not there where it is not", "[film]")
{
    const test::TemporaryFolder folder;
    Scene scene = test::opened(
        "local rapid = require 'rapid'\nreturn rapid.create { points = rapid.points.grid {} } :gravity {} :solve {}");
    {
        SceneFilm film = good(SceneFilm::begin(folder / "film.gif", {24, {32, 24}, {}}));
        CHECK(film.finish().error().message == "the film has no pictures; call add() first");
        for (int k = 1; k <= 3; ++k) {
            const SceneFrame frame = good(scene.advance());
            good(film.add(frame, good(scene.shapes(frame.number()))));
        }
        CHECK(film.done() <= 3);
        good(film.finish());
        CHECK(film.done() == 3);
        CHECK_THAT(film.add(good(scene.advance()), {}).error().message, Contains("the film is finished"));
        CHECK_THAT(film.finish().error().message, Contains("the film is finished"));
    }
    CHECK_THAT(test::file_text(folder / "film.gif"), StartsWith("GIF89a"));
    {
        SceneFilm film = good(SceneFilm::begin(folder / "given_up.gif", {24, {32, 24}, {}}));
        good(film.add(good(scene.advance()), {}));
    }
    CHECK(test::file_names(folder.path()) == std::vector<std::string>{"film.gif"});
}

// Contact sheets of pictures: their layout, missing pictures, and files that are not pictures.

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
