// The memory that drawing a picture takes.
#pragma once

namespace rapid {

// Throws Error if so many pictures of this size, which are drawn at the same time, do not fit in memory.
void require_picture_memory(int width, int height, bool colliders, double count, const char* remedy);

}  // namespace rapid
