// Numbers as people read them.
#pragma once

#include <cstdint>
#include <string>

namespace rapid {

std::string with_separators(std::uint64_t count);  // "1,234,567"
std::string in_millions(double count);             // "3.21 million"
std::string memory_text(std::uint64_t bytes);      // "85.2 MiB"
std::string duration_text(double seconds);         // "0.042 s", "2 min 05 s"

}  // namespace rapid
