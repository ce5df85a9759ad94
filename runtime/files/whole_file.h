// Files that a command writes in addition to frames, such as reports.
#pragma once

#include <filesystem>
#include <string_view>

namespace rapid {

// Writes a file completely or not at all. Throws Error, with the file's name, if the file system does.
void write_whole(const std::filesystem::path& path, std::string_view bytes);

}  // namespace rapid
