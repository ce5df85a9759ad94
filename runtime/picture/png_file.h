// Pictures as .png files: 8 bits per channel, sRGB.
#pragma once

#include <filesystem>
#include <string>

#include "runtime/picture/picture.h"

namespace rapid {

// Returns the file's bytes. Throws Error if there is not enough memory.
std::string encode_png(const Picture& picture);

// Throws Error if the file can't be read or is not a .png.
Picture read_png(const std::filesystem::path& file);

}  // namespace rapid
