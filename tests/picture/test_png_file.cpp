#include "runtime/picture/png_file.h"

#include <png.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {
namespace {

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

// Reads with libpng, which warns about a chunk that is damaged or in the wrong position.
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
