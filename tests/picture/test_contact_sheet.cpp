#include "runtime/picture/contact_sheet.h"

#include <png.h>

#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "runtime/picture/png_file.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Colour = std::array<int, 3>;

Picture plain(int width, int height, Colour colour)
{
    Picture picture{width, height, {}};
    for (int k = 0; k < width * height; ++k)
        for (const int channel : colour) picture.rgb.push_back(static_cast<std::uint8_t>(channel));
    return picture;
}

Colour at(const Picture& picture, int x, int y)
{
    const std::uint8_t* pixel = picture.pixel(x, y);
    return {pixel[0], pixel[1], pixel[2]};
}

// Pixels of the rectangle that differ from its left upper one.
int marks(const Picture& picture, int left, int top, int width, int height)
{
    int count = 0;
    for (int y = top; y < top + height; ++y)
        for (int x = left; x < left + width; ++x) count += at(picture, x, y) != at(picture, left, top);
    return count;
}

constexpr Colour red = {200, 10, 10}, blue = {10, 10, 200};

TEST_CASE("a contact sheet has tiles in order, each in its place")
{
    const Picture sheet = contact_sheet({{plain(800, 400, red), {"a"}},
                                         {plain(80, 40, blue), {"b"}},
                                         {{}, {"failed"}},
                                         {plain(800, 400, blue), {"d"}}});
    REQUIRE(sheet.width == 2 * 400 + 3 * 12);
    const int pitch = 200 + 22 + 2 * 12;
    REQUIRE(sheet.height == 2 * pitch + 12);
    CHECK(at(sheet, 12 + 200, 12 + 100) == red);
    CHECK(at(sheet, 12, 12) == red);
    CHECK(at(sheet, 12 + 399, 12 + 199) == red);
    CHECK(at(sheet, 12 + 412 + 200, 12 + 100) == blue);
    CHECK(at(sheet, 12 + 412 + 200, 12 + pitch + 100) == blue);
    CHECK(at(sheet, 12 + 200, 12 + pitch + 100) != red);
    CHECK(marks(sheet, 12, 12 + pitch, 400, 200) == 0);  // there is no picture
}

TEST_CASE("a picture of another shape is fitted into its tile")
{
    const Picture sheet = contact_sheet({{plain(200, 100, red), {}}, {plain(100, 200, blue), {}}});
    const int left = 12 + 412, top = 12;
    CHECK(at(sheet, left + 200, top + 1) == blue);
    CHECK(at(sheet, left + 200, top + 198) == blue);
    CHECK(at(sheet, left + 200 - 60, top + 100) != blue);  // 50 pixels to each side of the middle
    CHECK(at(sheet, left + 200 - 40, top + 100) == blue);
}

TEST_CASE("labels stay below their own tile, however long, and in ASCII")
{
    const Picture sheet = contact_sheet({{plain(200, 100, red), {std::string(5000, 'W'), "\xff\n"}}, {{}, {}}});
    CHECK(marks(sheet, 12, 12 + 200 + 2, 400, 2 * 22) > 100);
    CHECK(marks(sheet, 12 + 400 + 1, 12 + 200 + 2, 400, 2 * 22) == 0);
}

TEST_CASE("series of tiles begin with a row, or lie in one")
{
    const auto columns = [](std::size_t count, std::size_t series) {
        return (contact_sheet(std::vector<SheetTile>(count), series).width - 12) / (400 + 12);
    };
    CHECK(columns(20, 1) == 5);
    CHECK(columns(20, 4) == 4);
    CHECK(columns(20, 5) == 5);
    CHECK(columns(20, 10) == 5);  // each in two rows
    CHECK(columns(21, 3) == 6);   // two in a row
    CHECK(columns(14, 7) == 4);   // 7 and 1 are too far from a square
    CHECK(columns(12, 6) == 3);
}

TEST_CASE("a contact sheet of many tiles stays within 8,192 pixels")
{
    const Picture sheet = contact_sheet(std::vector<SheetTile>(900, {{}, {"x"}}));
    CHECK(sheet.width <= 8192);
    CHECK(sheet.rgb.size() == 3 * static_cast<std::size_t>(sheet.width) * sheet.height);
}

TEST_CASE("a picture is read from a .png as it was written")
{
    const test::TemporaryFolder folder;
    const auto [width, height] = GENERATE(table<int, int>({{7, 5}, {1, 1}, {640, 360}}));
    Picture picture{width, height, {}};
    for (unsigned k = 0; k < 3u * static_cast<unsigned>(width * height); ++k)
        picture.rgb.push_back(static_cast<std::uint8_t>(37 * k + k / 97 * k));
    const Picture again = read_png(folder.write("p.png", encode_png(picture)));
    CHECK(again.width == width);
    CHECK(again.height == height);
    CHECK(again.rgb == picture.rgb);

    CHECK_THROWS_WITH(read_png(folder.write("q.png", "no picture")), Catch::Matchers::Contains("can't be read"));
}

// By libpng, which warns of a chunk that is damaged or in the wrong place.
TEST_CASE("a .png says that its colours are sRGB, and by which primaries")
{
    const test::TemporaryFolder folder;
    const std::filesystem::path path = folder.write("p.png", encode_png({2, 1, {0, 1, 2, 3, 4, 5}}));
    std::string warnings;
    const auto note = [](png_structp png, png_const_charp text) {
        *static_cast<std::string*>(png_get_error_ptr(png)) += text;
    };
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &warnings, nullptr, note);
    png_infop info = png_create_info_struct(png);
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
    png_init_io(png, file.get());
    png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);

    int intent = -1;
    png_fixed_point gamma = 0, x[4], y[4];
    CHECK(png_get_sRGB(png, info, &intent) == PNG_INFO_sRGB);
    CHECK(png_get_gAMA_fixed(png, info, &gamma) == PNG_INFO_gAMA);
    CHECK(png_get_cHRM_fixed(png, info, x, y, x + 1, y + 1, x + 2, y + 2, x + 3, y + 3) == PNG_INFO_cHRM);
    CHECK(warnings.empty());
    CHECK(intent == PNG_sRGB_INTENT_PERCEPTUAL);
    CHECK(gamma == 45455);
    // White, red, green, blue (ITU-R BT.709).
    CHECK(std::vector<png_fixed_point>(x, x + 4) == std::vector<png_fixed_point>{31270, 64000, 30000, 15000});
    CHECK(std::vector<png_fixed_point>(y, y + 4) == std::vector<png_fixed_point>{32900, 33000, 60000, 6000});
    png_destroy_read_struct(&png, &info, nullptr);
}

}  // namespace
}  // namespace rapid
