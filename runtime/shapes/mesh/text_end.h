// The end of mesh files that are text. Assimp takes a cut one for a whole one.
#pragma once

#include <filesystem>

namespace rapid {

// Throws Error if an .stl that is text does not end with "endsolid". Other files pass.
void check_text_end(const std::filesystem::path& path);

}  // namespace rapid
