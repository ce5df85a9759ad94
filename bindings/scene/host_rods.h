// Constraints of a program: rods that a callback gives for each frame.
#pragma once

#include "include/rapid/offers.h"
#include "runtime/graph/evaluation.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// values: of the node's parameters. Null where it gives none. Error: what the callback throws; a rod of wrong numbers
// or between points that there are not.
std::shared_ptr<const Constraint> rods_of(const HostNode& node, const std::vector<double>& values,
                                          const std::string& group, const PointSet& points, const Evaluation& now);

}  // namespace rapid
