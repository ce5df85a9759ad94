// The picture of a frame.
#pragma once

#include "runtime/picture/frame_info.h"
#include "runtime/picture/picture.h"

namespace rapid {

// Draws a frame with the default options, scene, view and painter if the frame has none. Throws Error if the size is
// out of range.
Picture picture_of(const PointSet& points, const FrameInfo& frame);

// Throws Error unless each side has from 1 to 16384 pixels.
void require_picture_size(int width, int height);

// Throws Error like require_picture_size(), and also if `count` pictures of this size, drawn at the same time, do not
// fit in memory.
void require_picture_memory(int width, int height, bool colliders, double count, const char* remedy);

}  // namespace rapid
