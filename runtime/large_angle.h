// Range reduction for angles that are too large for a few parts of π.
#pragma once

#include "runtime/elementary.h"

namespace rapid {

// Returns the number of quarter turns, modulo 4, and the remaining angle (Payne and Hanek 1983). Precondition: the
// angle is finite, and |angle| > elementary::most_angle.
elementary::Quarters<double> quarters_of_large(double angle);

}  // namespace rapid
