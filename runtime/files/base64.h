// Base64 (RFC 4648).
#pragma once

#include <string_view>
#include <vector>

namespace rapid {

// Decodes `bytes` bytes from the beginning of the text and sets `length` to the characters used. Throws Error if the
// text ends early or is not Base64.
std::vector<unsigned char> from_base64(std::string_view text, std::size_t bytes, std::size_t& length);

// Decodes a whole text, which must consist of complete groups of four characters.
std::vector<unsigned char> from_base64(std::string_view text);

}  // namespace rapid
