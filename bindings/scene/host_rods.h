// Constraints of a program: rods that a callback returns for each frame.
#pragma once

#include "include/rapid/offers.h"
#include "runtime/graph/evaluation.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {

// values: of the node's parameters. Returns null if there are no rods. Throws the callback's exception, or Error if a
// rod has wrong numbers or unknown points.
std::shared_ptr<const Constraint> rods_of(const HostNode& node, const std::vector<double>& values,
                                          const std::string& group, const PointSet& points, const Evaluation& now);

}  // namespace rapid
