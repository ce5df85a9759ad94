// The frame that is written or drawn, apart from its points.
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

    // Settings for pictures (picture.h). Null selects the defaults: default options, only the points, a view fitted to
    // this frame. FrameWriter keeps a view and a painter for a sequence.
    std::shared_ptr<const PictureOptions> picture = nullptr;
    std::shared_ptr<const PictureScene> scene = nullptr;
    std::shared_ptr<const PictureView> view = nullptr;
    std::shared_ptr<Painter> painter = nullptr;  // null: a new one for this frame
};

}  // namespace rapid
