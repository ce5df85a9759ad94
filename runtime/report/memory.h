// Peak memory of the process.
#pragma once

#include <cstdint>

namespace rapid {

// Returns the largest resident set size so far (VmHWM), bytes; 0 if the system does not report it.
std::uint64_t peak_memory();

}  // namespace rapid
