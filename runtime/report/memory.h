// How much memory the process has needed.
#pragma once

#include <cstdint>

namespace rapid {

// The largest resident size so far, in bytes: VmHWM. 0 where the system does not tell.
std::uint64_t peak_memory();

}  // namespace rapid
