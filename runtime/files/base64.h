// Base64 (RFC 4648).
#pragma once

#include <string_view>
#include <vector>

namespace rapid {

// `bytes` bytes from the beginning of the text, whose length in characters is put into `length`. Error: it ends early,
// or is no base64.
std::vector<unsigned char> from_base64(std::string_view text, std::size_t bytes, std::size_t& length);

// All that a text of whole groups of four characters holds.
std::vector<unsigned char> from_base64(std::string_view text);

}  // namespace rapid
