// Makes foreign text (names in files, messages of libraries) safe for a terminal, which interprets some characters as
// commands.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace rapid {

// Escapes control characters other than tab and newline as \xNN, including those of two bytes in UTF-8 (U+0080 to
// U+009F).
std::string printable(std::string_view text);

// Replaces the middle of a text with more than `most` bytes.
std::string shortened(std::string_view text, std::size_t most);

// Returns a name or value from a file as one line of bounded length: shortened, with tab and newline escaped, too.
std::string printable_name(std::string_view name);

// Returns the column width for such a text in a table. It is bounded, so that a very long one does not widen all lines.
std::size_t width_of(std::string_view text);

}  // namespace rapid
