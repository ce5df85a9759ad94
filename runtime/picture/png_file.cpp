#include "runtime/picture/png_file.h"

#include <fmt/format.h>
#include <png.h>

#include <csetjmp>
#include <cstdlib>
#include <new>
#include <utility>

namespace rapid {
namespace {

// libpng's description of one picture, freed in the end.
struct PngImage : png_image {
    PngImage() : png_image{} { version = PNG_IMAGE_VERSION; }
    ~PngImage() { png_image_free(this); }
    PngImage(const PngImage&) = delete;
    PngImage& operator=(const PngImage&) = delete;
};

// libpng reports errors by longjmp, which must not cross a C++ frame with destructors: the callback only records the
// error, and the frame that it returns to holds nothing else.
struct PngOutput {
    std::string bytes;
    std::string error;
    bool has_memory = true;
};

// libpng and zlib say in words of their own that memory ran out, each another: noted where it happens.
void* allocate(png_structp png, png_alloc_size_t size)
{
    void* const block = std::malloc(size);
    if (!block) static_cast<PngOutput*>(png_get_mem_ptr(png))->has_memory = false;
    return block;
}

void release(png_structp, void* block) { std::free(block); }

void note_error(png_structp png, png_const_charp message)
{
    static_cast<PngOutput*>(png_get_error_ptr(png))->error = message;
    png_longjmp(png, 1);
}

void take_bytes(png_structp png, png_bytep data, png_size_t size)
{
    PngOutput& output = *static_cast<PngOutput*>(png_get_io_ptr(png));
    try {
        output.bytes.append(reinterpret_cast<const char*>(data), size);
        return;
    } catch (const std::bad_alloc&) {
        output.has_memory = false;
    }
    png_error(png, "out of memory");
}

void encode(const Picture& picture, PngOutput& output)
{
    png_structp png =
        png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &output, note_error, nullptr, &output, allocate, release);
    if (!png) {
        output.error = "libpng does not start";
        return;
    }
    png_infop info = png_create_info_struct(png);
    if (!info || setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        return;
    }
    png_set_write_fn(png, &output, take_bytes, nullptr);
    png_set_IHDR(png, info, static_cast<png_uint_32>(picture.width), static_cast<png_uint_32>(picture.height), 8,
                 PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    // Level 4 takes a third of the time of level 6, for a tenth more bytes.
    png_set_compression_level(png, 4);
    png_write_info(png, info);
    for (int y = 0; y < picture.height; ++y) png_write_row(png, picture.pixel(0, y));
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
}

}  // namespace

std::string encode_png(const Picture& picture)
{
    PngOutput output;
    encode(picture, output);
    if (!output.has_memory) throw Error("can't be written: out of memory");
    if (!output.error.empty()) throw Error(fmt::format("can't be written: {}", output.error));
    return std::move(output.bytes);
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
