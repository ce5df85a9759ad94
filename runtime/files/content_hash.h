// Hashes of contents (XXH3): equal bytes have equal ones, in any process and on any machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace rapid {

std::uint64_t content_hash(std::string_view bytes);

// Of a file, which is read piece by piece. Error: it can't be read.
std::uint64_t file_hash(const std::filesystem::path& path);

// 16 digits.
std::string hash_text(std::uint64_t hash);

}  // namespace rapid
