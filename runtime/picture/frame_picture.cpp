#include "runtime/picture/frame_picture.h"

#include <fmt/format.h>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/picture/picture_fit.h"
#include "runtime/picture/surfaces.h"

namespace rapid {

Picture picture_of(const PointSet& points, const FrameInfo& frame)
{
    static const PictureOptions usual;
    static const auto nothing = std::make_shared<const PictureScene>();
    const PictureOptions& options = frame.picture ? *frame.picture : usual;
    require_picture_size(options.width, options.height);
    const PictureView view = frame.view ? *frame.view : PictureFit().next(points, frame);
    const auto painter = frame.painter ? frame.painter : std::make_shared<Painter>();
    return painter->draw(points, options, frame.scene ? frame.scene : nothing, view);
}

void require_picture_size(int width, int height)
{
    if (width < 1 || height < 1 || width > 16384 || height > 16384)
        throw Error(
            fmt::format("a picture of {} x {} can't be made; each side must be from 1 to 16384 pixels", width, height));
}

void require_picture_memory(int width, int height, bool colliders, double count, const char* remedy)
{
    require_picture_size(width, height);
    constexpr double of_picture = 3, of_file = 6;  // bytes per pixel: rows, plain and compressed
    const double bytes = (surface_bytes_per_pixel(colliders) + of_picture + of_file) * count * width * height;
    if (!fits_in_memory(bytes)) throw memory_exceeded(fmt::format("pictures of {}x{}", width, height), bytes, remedy);
}

}  // namespace rapid
