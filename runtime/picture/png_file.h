// Pictures as .png: 8 bits a channel, sRGB.
#pragma once

#include <filesystem>
#include <string>

#include "runtime/picture/picture.h"

namespace rapid {

// The file's bytes. Error: there is not enough memory.
std::string encode_png(const Picture& picture);

// Error: it can't be read, or is no .png.
Picture read_png(const std::filesystem::path& file);

}  // namespace rapid
