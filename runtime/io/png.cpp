// .png: a picture of the points (picture.h), 8 bits per channel, sRGB.
#include <string>

#include "runtime/io/format.h"
#include "runtime/picture/frame_picture.h"
#include "runtime/picture/png_file.h"

namespace rapid {
namespace {

void write_png(OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    const std::string bytes = encode_png(picture_of(points, frame));
    file.append(bytes.data(), bytes.size());
}

RAPID_FORMAT(Format{".png", "a picture, 1280 x 720, the camera fitted to the scene", write_png, nullptr});

}  // namespace
}  // namespace rapid
