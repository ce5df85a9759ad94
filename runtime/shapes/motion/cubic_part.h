// Reparametrises the section of a cubic between two times to the range 0 to 1.
#pragma once

#include "runtime/shapes/motion/body_path.h"

namespace rapid {

inline Cubic<Vec3d> cubic_part(const Cubic<Vec3d>& curve, double from, double to)
{
    const double d = to - from;
    return {curve.at(from), d * curve.derivative(from), d * d * (curve.c2 + 3 * from * curve.c3), d * d * d * curve.c3};
}

}  // namespace rapid
