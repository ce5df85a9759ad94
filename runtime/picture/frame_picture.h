// The picture of a frame.
#pragma once

#include "runtime/picture/frame_info.h"
#include "runtime/picture/picture.h"

namespace rapid {

// Draws a frame with the default options, scene, view and painter if the frame has none. Throws Error if the size is
// out of range.
Picture picture_of(const PointSet& points, const FrameInfo& frame);

}  // namespace rapid
