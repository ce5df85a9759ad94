// Checks the end of text mesh files, because Assimp accepts truncated ones.
#pragma once

#include <filesystem>

namespace rapid {

// Throws Error if a text .stl does not end with "endsolid". Accepts all other files.
void check_text_end(const std::filesystem::path& path);

}  // namespace rapid
