// Peak memory of the process.
#pragma once

#include <cstdint>

namespace rapid {

// The largest resident set size so far (VmHWM), bytes; 0 where the system does not report it.
std::uint64_t peak_memory();

}  // namespace rapid
