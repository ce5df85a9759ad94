// How large a picture may be.
#pragma once

namespace rapid {

// Throws Error unless each side has from 1 to 16384 pixels.
void require_picture_size(int width, int height);

// Throws Error as require_picture_size() does, and if so many pictures of this size, which are drawn at the same time,
// do not fit in memory.
void require_picture_memory(int width, int height, bool colliders, double count, const char* remedy);

}  // namespace rapid
