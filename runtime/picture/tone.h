// Converts linear light to the bytes of a picture.
#pragma once

#include <cstdint>
#include <span>

#include "runtime/math/vec.h"

namespace rapid {

// Writes the pixels of a row from x on, a multiple of 8. sRGB, 8 bits per channel, dithered against banding in dark
// gradients. Light up to 0.8 keeps its value; brighter light is compressed below 1 instead of being clipped. NaN is
// black.
void write_pixels(std::span<const Vec3f> light, int x, int y, std::uint8_t* rgb);

// Returns the byte of one channel, without dither.
std::uint8_t display_byte(float light);

}  // namespace rapid
