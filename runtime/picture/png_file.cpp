#include "runtime/picture/png_file.h"

#include <fmt/format.h>
#include <png.h>

namespace rapid {
namespace {

// libpng's description of one picture, freed in the end.
struct PngImage : png_image {
    PngImage() : png_image{} { version = PNG_IMAGE_VERSION; }
    ~PngImage() { png_image_free(this); }
    PngImage(const PngImage&) = delete;
    PngImage& operator=(const PngImage&) = delete;
};

}  // namespace

std::string encode_png(const Picture& picture)
{
    PngImage image;
    image.width = static_cast<png_uint_32>(picture.width);
    image.height = static_cast<png_uint_32>(picture.height);
    image.format = PNG_FORMAT_RGB;
    std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
    png_alloc_size_t size = bytes.size();
    if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr))
        throw Error(image.message);
    bytes.resize(size);
    return bytes;
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
