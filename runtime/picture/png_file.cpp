#include "runtime/picture/png_file.h"

#include <fmt/format.h>
#include <libdeflate.h>
#include <png.h>

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <new>
#include <string_view>

namespace rapid {
namespace {

// The image description of libpng, freed on destruction.
struct PngImage : png_image {
    PngImage() : png_image{} { version = PNG_IMAGE_VERSION; }
    ~PngImage() { png_image_free(this); }
    PngImage(const PngImage&) = delete;
    PngImage& operator=(const PngImage&) = delete;
};

std::string big_endian(std::initializer_list<std::uint32_t> numbers)
{
    std::string bytes;
    for (const std::uint32_t number : numbers)
        for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(number >> shift);
    return bytes;
}

// Appends a chunk to the file (PNG specification, 5.3): the length of the data, its name, the data, and a checksum of
// name and data.
void append_chunk(std::string& file, std::string_view name, std::string_view data)
{
    file.reserve(file.size() + data.size() + 12);
    file += big_endian({static_cast<std::uint32_t>(data.size())});
    const std::size_t begin = file.size();
    file.append(name).append(data);
    file += big_endian({libdeflate_crc32(0, file.data() + begin, file.size() - begin)});
}

// Returns the rows in zlib's format, each after a byte for its filter (9.2). Uses no filter: the dither repeats every
// eight pixels, which the compressor finds and a filter would hide.
std::string compressed(const Picture& picture)
{
    const std::size_t row = 3 * static_cast<std::size_t>(picture.width),
                      rows = static_cast<std::size_t>(picture.height);
    std::string plain(rows * (1 + row), '\0');
    for (std::size_t y = 0; y < rows; ++y) std::copy_n(&picture.rgb[y * row], row, &plain[y * (1 + row) + 1]);
    // Level 1 takes a quarter of the time of level 6, and a fifth more space.
    const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
        libdeflate_alloc_compressor(1), libdeflate_free_compressor);
    if (!compressor) throw std::bad_alloc();
    std::string result(libdeflate_zlib_compress_bound(compressor.get(), plain.size()), '\0');
    result.resize(libdeflate_zlib_compress(compressor.get(), plain.data(), plain.size(), result.data(), result.size()));
    return result;
}

}  // namespace

std::string encode_png(const Picture& picture)
{
    using namespace std::string_literals;
    try {
        std::string file = "\x89PNG\r\n\x1a\n";
        const auto width = static_cast<std::uint32_t>(picture.width),
                   height = static_cast<std::uint32_t>(picture.height);
        append_chunk(file, "IHDR", big_endian({width, height}) + "\x08\x02\0\0\0"s);  // 8 bits of red, green and blue
        append_chunk(file, "sRGB", "\0"s);                                            // perceptual
        // The equivalent for readers without sRGB support (11.3.2.5): gamma, white point and primaries, times 100,000.
        append_chunk(file, "gAMA", big_endian({45455}));
        append_chunk(file, "cHRM", big_endian({31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000}));
        append_chunk(file, "IDAT", compressed(picture));
        append_chunk(file, "IEND", "");
        return file;
    } catch (const std::bad_alloc&) {
        throw Error("can't be written: out of memory", ErrorKind::OutOfMemory);
    }
}

Picture read_png(const std::filesystem::path& file)
{
    PngImage image;
    if (!png_image_begin_read_from_file(&image, file.c_str()))
        throw Error(fmt::format("can't be read: {}", image.message)).at({file.string(), 0});
    image.format = PNG_FORMAT_RGB;
    Picture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
    picture.rgb.resize(PNG_IMAGE_SIZE(image));
    const png_color background = {0, 0, 0};
    if (!png_image_finish_read(&image, &background, picture.rgb.data(), 0, nullptr))
        throw Error(fmt::format("can't be read: {}", image.message)).at({file.string(), 0});
    return picture;
}

}  // namespace rapid
