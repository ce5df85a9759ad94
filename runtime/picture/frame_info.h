// The frame that is written or drawn, besides its points.
#pragma once

#include <memory>

namespace rapid {

class Painter;
struct PictureOptions;
struct PictureScene;
struct PictureView;

struct FrameInfo {
    int number = 1;
    double time = 0;  // s since the start
    double fps = 24;

    // For pictures (picture.h). Null: the usual ones; the points alone; fitted to this one frame. FrameWriter keeps a
    // view and a painter over a sequence.
    std::shared_ptr<const PictureOptions> picture = nullptr;
    std::shared_ptr<const PictureScene> scene = nullptr;
    std::shared_ptr<const PictureView> view = nullptr;
    std::shared_ptr<Painter> painter = nullptr;  // null: one for this frame alone
};

}  // namespace rapid
