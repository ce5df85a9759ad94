// Text of others (names in files, messages of libraries) for a terminal, which takes some characters for commands.
#pragma once

#include <string>
#include <string_view>

namespace rapid {

// Control characters but tab and newline, also those of two bytes in UTF-8 (U+0080 to U+009F), as \xNN.
std::string printable(std::string_view text);

}  // namespace rapid
