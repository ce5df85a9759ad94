// Files that a command writes beside frames: reports, pictures of them.
#pragma once

#include <filesystem>
#include <string_view>

namespace rapid {

// Writes a file whole, or not at all. Error, with its name: the file system's.
void write_whole(const std::filesystem::path& path, std::string_view bytes);

}  // namespace rapid
