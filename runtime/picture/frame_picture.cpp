#include "runtime/picture/frame_picture.h"

#include "runtime/picture/picture_fit.h"
#include "runtime/picture/picture_memory.h"

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

}  // namespace rapid
