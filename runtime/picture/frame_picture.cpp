#include "runtime/picture/frame_picture.h"

#include <fmt/format.h>

#include "runtime/error.h"
#include "runtime/picture/picture_fit.h"

namespace rapid {

Picture picture_of(const PointSet& points, const FrameInfo& frame)
{
    static const PictureOptions usual;
    static const auto nothing = std::make_shared<const PictureScene>();
    const PictureOptions& options = frame.picture ? *frame.picture : usual;
    if (options.width < 1 || options.height < 1 || options.width > 16384 || options.height > 16384)
        throw Error(fmt::format("a picture of {} x {} can't be made; each side must be from 1 to 16384 pixels",
                                options.width, options.height));
    const PictureView view = frame.view ? *frame.view : PictureFit().next(points, frame);
    const auto painter = frame.painter ? frame.painter : std::make_shared<Painter>();
    return painter->draw(points, options, frame.scene ? frame.scene : nothing, view);
}

}  // namespace rapid
