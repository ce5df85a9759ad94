// Text of others (names in files, messages of libraries) for a terminal, which takes some characters for commands.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace rapid {

// Control characters but tab and newline, also those of two bytes in UTF-8 (U+0080 to U+009F), as \xNN.
std::string printable(std::string_view text);

// With its middle left out where a name or a value makes it longer than so many bytes.
std::string shortened(std::string_view text, std::size_t most);

// A name or a value from a file, in one line of bounded length: shortened, and tab and newline as \xNN, too.
std::string printable_name(std::string_view name);

// What a table has room for in the column of such a text: one that is endless does not make all lines as long.
std::size_t width_of(std::string_view text);

}  // namespace rapid
