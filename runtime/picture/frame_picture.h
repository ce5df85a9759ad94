// The picture of a frame.
#pragma once

#include "runtime/picture/frame_info.h"
#include "runtime/picture/picture.h"

namespace rapid {

// With the usual options, scene, view and painter where the frame has none. Error: a size that no picture can have.
Picture picture_of(const PointSet& points, const FrameInfo& frame);

}  // namespace rapid
