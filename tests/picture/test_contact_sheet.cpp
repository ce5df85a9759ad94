#include "runtime/picture/contact_sheet.h"

#include <array>

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

// Counts the pixels of the rectangle that differ from its upper left one.
int marks(const Picture& picture, int left, int top, int width, int height)
{
    int count = 0;
    for (int y = top; y < top + height; ++y)
        for (int x = left; x < left + width; ++x) count += at(picture, x, y) != at(picture, left, top);
    return count;
}

constexpr Colour red_pixel = {200, 10, 10}, blue_pixel = {10, 10, 200};

TEST_CASE("a contact sheet has tiles in order, each in its place")
{
    const Picture sheet = contact_sheet({{plain(800, 400, red_pixel), {"a"}},
                                         {plain(80, 40, blue_pixel), {"b"}},
                                         {{}, {"failed"}},
                                         {plain(800, 400, blue_pixel), {"d"}}});
    REQUIRE(sheet.width == 2 * 400 + 3 * 12);
    const int pitch = 200 + 22 + 2 * 12;
    REQUIRE(sheet.height == 2 * pitch + 12);
    CHECK(at(sheet, 12 + 200, 12 + 100) == red_pixel);
    CHECK(at(sheet, 12, 12) == red_pixel);
    CHECK(at(sheet, 12 + 399, 12 + 199) == red_pixel);
    CHECK(at(sheet, 12 + 412 + 200, 12 + 100) == blue_pixel);
    CHECK(at(sheet, 12 + 412 + 200, 12 + pitch + 100) == blue_pixel);
    CHECK(at(sheet, 12 + 200, 12 + pitch + 100) != red_pixel);
    CHECK(marks(sheet, 12, 12 + pitch, 400, 200) == 0);  // there is no picture
}

TEST_CASE("a picture of another shape is fitted into its tile")
{
    const Picture sheet = contact_sheet({{plain(200, 100, red_pixel), {}}, {plain(100, 200, blue_pixel), {}}});
    const int left = 12 + 412, top = 12;
    CHECK(at(sheet, left + 200, top + 1) == blue_pixel);
    CHECK(at(sheet, left + 200, top + 198) == blue_pixel);
    CHECK(at(sheet, left + 200 - 60, top + 100) != blue_pixel);  // it covers 50 pixels to each side of the middle
    CHECK(at(sheet, left + 200 - 40, top + 100) == blue_pixel);
}

TEST_CASE("labels stay below their own tile, however long, and in ASCII")
{
    const Picture sheet = contact_sheet({{plain(200, 100, red_pixel), {std::string(5000, 'W'), "\xff\n"}}, {{}, {}}});
    CHECK(marks(sheet, 12, 12 + 200 + 2, 400, 2 * 22) > 100);
    CHECK(marks(sheet, 12 + 400 + 1, 12 + 200 + 2, 400, 2 * 22) == 0);
}

TEST_CASE("each letter of a label is drawn whole, whatever precedes it")
{
    const auto marks_of = [](const std::string& label) {
        return marks(contact_sheet({{plain(200, 100, red_pixel), {label}}}), 12, 12 + 200 + 2, 400, 22);
    };
    for (char letter = '!'; letter <= '~'; ++letter) {
        CAPTURE(letter);
        CHECK(marks_of({letter}) > 0);
        CHECK(marks_of({letter, letter}) == 2 * marks_of({letter}));
    }
}

TEST_CASE("series of tiles begin with a row, or lie in one")
{
    const auto columns = [](std::size_t count, std::size_t series) {
        return (contact_sheet(std::vector<SheetTile>(count), series).width - 12) / (400 + 12);
    };
    CHECK(columns(20, 1) == 5);
    CHECK(columns(20, 4) == 4);
    CHECK(columns(20, 5) == 5);
    CHECK(columns(20, 10) == 5);  // each series in two rows
    CHECK(columns(21, 3) == 6);   // two series per row
    CHECK(columns(14, 7) == 4);   // 7 and 1 are too far from a square
    CHECK(columns(12, 6) == 3);
}

TEST_CASE("a contact sheet of many tiles stays within 8,192 pixels")
{
    const Picture sheet = contact_sheet(std::vector<SheetTile>(900, {{}, {"x"}}));
    CHECK(sheet.width <= 8192);
    CHECK(sheet.rgb.size() == 3 * static_cast<std::size_t>(sheet.width) * sheet.height);
}

}  // namespace
}  // namespace rapid
