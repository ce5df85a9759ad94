// The compression method of zlib and zip files (RFC 1951).
#pragma once

#include <cstddef>

namespace rapid {

inline constexpr std::size_t max_deflate_expansion = 1032;  // output bytes per input byte, at most

}  // namespace rapid
