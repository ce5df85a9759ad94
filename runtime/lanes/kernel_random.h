// The random numbers of kernels (p:rand).
#pragma once

#include <cstdint>

#include "runtime/math/random.h"

namespace rapid {

// Returns the key for numbers that differ between frames. frame: its number, or a time.
RandomKey key_in_frame(RandomKey key, double frame);

// Returns a point's number for a use. frame: 0, or the one passed to key_in_frame().
double kernel_random(RandomKey key, std::uint64_t id, double use, double frame);

}  // namespace rapid
