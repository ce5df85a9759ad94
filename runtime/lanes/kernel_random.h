// The random numbers of kernels (p:rand).
#pragma once

#include <cstdint>

#include "runtime/random.h"

namespace rapid {

// The key of the numbers that differ from frame to frame; frame: its number, or a time.
RandomKey key_in_frame(RandomKey key, double frame);

// A point's number for a use; frame: 0, or that of key_in_frame().
double kernel_random(RandomKey key, std::uint64_t id, double use, double frame);

}  // namespace rapid
