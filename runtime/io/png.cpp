// .png: a picture of the points (picture.h), 8 bits a channel, sRGB.
#include <fmt/format.h>
#include <png.h>

#include <csetjmp>
#include <string>

#include "runtime/io/format.h"
#include "runtime/picture/frame_picture.h"

namespace rapid {
namespace {

// libpng reports errors by longjmp, which must not cross a C++ frame with destructors: the callback only records the
// error, and the frame that it returns to holds nothing else.
struct PngOutput {
    std::string bytes;
    std::string error;
};

void note_error(png_structp png, png_const_charp message)
{
    static_cast<PngOutput*>(png_get_error_ptr(png))->error = message;
    png_longjmp(png, 1);
}

void take_bytes(png_structp png, png_bytep data, png_size_t size)
{
    static_cast<PngOutput*>(png_get_io_ptr(png))->bytes.append(reinterpret_cast<const char*>(data), size);
}

void encode(const Picture& picture, PngOutput& output)
{
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &output, note_error, nullptr);
    if (!png) {
        output.error = "out of memory";
        return;
    }
    png_infop info = png_create_info_struct(png);
    if (!info || setjmp(png_jmpbuf(png))) {
        if (output.error.empty()) output.error = "out of memory";
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

void write_png(OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    PngOutput output;
    encode(picture_of(points, frame), output);
    if (!output.error.empty()) throw Error(fmt::format("can't be written: {}", output.error));

    file.append(output.bytes.data(), output.bytes.size());
}

RAPID_FORMAT(Format{".png", "a picture, 1280 x 720, the camera fitted to the scene", write_png, nullptr});

}  // namespace
}  // namespace rapid
