// The number of substeps that grains need to hold each other.
//
// One sweep in a substep passes a change of load on to about one more grain. A pile that is solved in this way yields
// like one of elastic grains with the stiffness m/dt². It stands like one of rigid grains if
//
//   κ = m / (4 p r dt²)
//
// is large enough for each grain, with p the pressure under it. For a pile of N equal grains κ is r / (N g dt²).
// Otherwise load lags behind motion, contacts lose their grip, and slopes become flatter.
#pragma once

#include <span>

#include "runtime/math/vec.h"
#include "runtime/points/point_set.h"

namespace rapid {

// Returns the number of substeps, at least 1, for a frame of h seconds with one iteration each. acceleration: m/s²,
// common to all points. radii: m, by point, 0 for points without contacts. loads_add_up: false with mass scaling, by
// which a grain carries little more than itself.
double pile_substeps(const PointSet& points, std::span<const float> radii, const Vec3d& acceleration, double h,
                     bool loads_add_up = true);

}  // namespace rapid
