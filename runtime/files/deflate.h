// The compression of zlib and of zip files (RFC 1951).
#pragma once

#include <cstddef>

namespace rapid {

inline constexpr std::size_t most_deflate_expansion = 1032;  // bytes that it makes of one

}  // namespace rapid
