// Formats numbers for people.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rapid {

std::string with_separators(std::uint64_t count);  // "1,234,567"
std::string in_millions(double count);             // "3.21 million"
std::string memory_text(std::uint64_t bytes);      // "85.2 MiB"
std::string duration_text(double seconds);         // "0.042 s", "2 min 05 s"
std::string length_text(double metres);            // "1.2 mm", "0.75 µm"

// Returns a line for each row. Columns are as wide as their longest cell; the first `left` are aligned to the left. The
// first row has the titles, and all columns.
using TextTable = std::vector<std::vector<std::string>>;
std::string table_text(const TextTable& rows, std::size_t left = 0);

}  // namespace rapid
