// From linear light to the bytes of a picture.
#pragma once

#include <cstdint>

#include "runtime/vec.h"

namespace rapid {

// sRGB, 8 bits a channel, dithered against banding in dark gradients. Light up to 0.8 keeps its value; brighter light
// is compressed below 1 instead of being cut off. NaN is black.
void write_pixel(const Vec3f& light, int x, int y, std::uint8_t* rgb);

}  // namespace rapid
