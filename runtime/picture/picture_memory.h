// Limits on the size of a picture.
#pragma once

namespace rapid {

// Throws Error unless each side has from 1 to 16384 pixels.
void require_picture_size(int width, int height);

// Throws Error like require_picture_size(), and also if `count` pictures of this size, drawn at the same time, do not
// fit in memory.
void require_picture_memory(int width, int height, bool colliders, double count, const char* remedy);

}  // namespace rapid
