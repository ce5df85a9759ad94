// The drag that points bear as attributes, whatever node has given them: targetv and airresist, as Houdini names them.
//
//   a = -airresist (v - targetv)        exact at any step
#pragma once

#include <memory>

#include "runtime/graph/evaluation.h"
#include "runtime/solver/forces.h"

namespace rapid {

// Null where no point has an airresist above 0.
std::shared_ptr<const Force> air_resistance_of(const PointSet& points, const Evaluation& now);

}  // namespace rapid
