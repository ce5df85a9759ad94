#include "runtime/picture/contact_sheet.h"

#define STB_IMAGE_RESIZE_IMPLEMENTATION
#define STB_IMAGE_RESIZE_STATIC
#include <stb/stb_easy_font.h>
#include <stb/stb_image_resize.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace rapid {
namespace {

using Colour = std::array<std::uint8_t, 3>;

constexpr Colour paper = {30, 31, 34}, empty = {44, 46, 50}, ink = {222, 224, 228};
constexpr int gap = 12, text_scale = 2, line_height = 11 * text_scale;  // pixels
constexpr int widest_sheet = 8192, widest_tile = 400, narrowest_tile = 96;

void fill(Picture& sheet, int x, int y, int width, int height, const Colour& colour)
{
    for (int row = std::max(y, 0); row < std::min(y + height, sheet.height); ++row)
        for (int column = std::max(x, 0); column < std::min(x + width, sheet.width); ++column)
            std::copy(colour.begin(), colour.end(),
                      &sheet.rgb[3 * (static_cast<std::size_t>(row) * sheet.width + column)]);
}

// Returns the longest beginning of the text that fits the width. A truncated text ends with dots.
std::string cut(std::string text, int width)
{
    for (char& c : text)
        if (c < 32 || c > 126) c = '?';
    if (stb_easy_font_width(text.data()) <= width) return text;
    while (!text.empty() && stb_easy_font_width((text + "...").data()) > width) text.pop_back();
    return text + "...";
}

void write_line(Picture& sheet, int x, int y, int width, const std::string& line)
{
    struct Vertex {
        float x, y, z;
        std::uint8_t colour[4];
    };
    std::string text = cut(line, width / text_scale);
    std::vector<Vertex> vertices(4 * 70 * text.size() + 4);
    const int quads = stb_easy_font_print(0, 0, text.data(), nullptr, vertices.data(),
                                          static_cast<int>(vertices.size() * sizeof(Vertex)));
    for (int q = 0; q < quads; ++q) {
        const Vertex &from = vertices[4 * q], &to = vertices[4 * q + 2];
        const auto pixel = [](float at) { return static_cast<int>(std::lround(at)) * text_scale; };
        fill(sheet, x + pixel(from.x), y + pixel(from.y), pixel(to.x) - pixel(from.x), pixel(to.y) - pixel(from.y),
             ink);
    }
}

// Draws a picture centred in a tile, as large as it fits.
void draw(Picture& sheet, int x, int y, int width, int height, const Picture& picture)
{
    const double scale =
        std::min(static_cast<double>(width) / picture.width, static_cast<double>(height) / picture.height);
    const int fitted_width = std::max(1, static_cast<int>(std::lround(scale * picture.width)));
    const int fitted_height = std::max(1, static_cast<int>(std::lround(scale * picture.height)));
    const int left = x + (width - fitted_width) / 2, top = y + (height - fitted_height) / 2;
    stbir_resize_uint8_srgb(picture.rgb.data(), picture.width, picture.height, 0,
                            &sheet.rgb[3 * (static_cast<std::size_t>(top) * sheet.width + left)], fitted_width,
                            fitted_height, 3 * sheet.width, 3, STBIR_ALPHA_CHANNEL_NONE, 0);
}

// Returns the number of columns nearest to a square that holds whole series per row, or a series in whole rows.
int columns_of(int count, int series)
{
    const int square = std::max(1, static_cast<int>(std::ceil(std::sqrt(count))));
    const auto fits = [&](int columns) { return columns % series == 0 || series % columns == 0; };
    for (int off = 0; 2 * off <= square; ++off)
        for (const int columns : {square - off, square + off})
            if (fits(columns)) return columns;
    return square;
}

}  // namespace

Picture contact_sheet(const std::vector<SheetTile>& tiles, std::size_t series)
{
    const int count = static_cast<int>(tiles.size());
    const int columns = columns_of(count, static_cast<int>(series)), rows = (count + columns - 1) / columns;
    const int width = std::clamp((widest_sheet - gap) / columns - gap, narrowest_tile, widest_tile);
    double shape = 9.0 / 16;  // height / width
    std::size_t lines = 0;
    for (const SheetTile& tile : tiles) lines = std::max(lines, tile.label.size());
    const auto first = std::find_if(tiles.begin(), tiles.end(), [](auto& tile) { return tile.picture.width > 0; });
    if (first != tiles.end()) shape = static_cast<double>(first->picture.height) / first->picture.width;
    const int height = std::max(1, static_cast<int>(std::lround(shape * width)));
    const int pitch = height + static_cast<int>(lines) * line_height + 2 * gap;

    Picture sheet{columns * (width + gap) + gap, rows * pitch + gap, {}};
    sheet.rgb.resize(3 * static_cast<std::size_t>(sheet.width) * sheet.height);
    fill(sheet, 0, 0, sheet.width, sheet.height, paper);
    for (int k = 0; k < count; ++k) {
        const int x = gap + k % columns * (width + gap), y = gap + k / columns * pitch;
        fill(sheet, x, y, width, height, empty);
        if (tiles[k].picture.width > 0) draw(sheet, x, y, width, height, tiles[k].picture);
        for (std::size_t line = 0; line < tiles[k].label.size(); ++line)
            write_line(sheet, x, y + height + gap / 2 + static_cast<int>(line) * line_height, width,
                       tiles[k].label[line]);
    }
    return sheet;
}

}  // namespace rapid
