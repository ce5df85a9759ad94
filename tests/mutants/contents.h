// Everything that a reader extracts from a file, as bytes.
#pragma once

#include <filesystem>
#include <string>

namespace rapid::test {

using ContentOf = std::string (*)(const std::filesystem::path& path);

// These throw what the readers throw.
std::string content_of_points(const std::filesystem::path& path);
std::string content_of_mesh(const std::filesystem::path& path);
std::string content_of_level_set(const std::filesystem::path& path);
std::string content_of_vector_grid(const std::filesystem::path& path);
std::string content_of_fog(const std::filesystem::path& path);
std::string content_of_state(const std::filesystem::path& path);

}  // namespace rapid::test
