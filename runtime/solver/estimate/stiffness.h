// Detection of stiff forces and actions: those whose time scale is that of a substep or shorter.
//
// A sample of the points is examined at the current positions. The rates of linear drags and springs are known, and
// these are solved exactly at any step. For all other parts, the Jacobians of the acceleration by position and
// velocity, J and K, are computed by finite differences: the eigenvalues of x'' = J x + K x' give the rates of
// oscillation and decay. The resulting error is computed, not guessed: the frame of the sample is solved with the
// given substeps, with as many as resolve the motion, and with many more.
#pragma once

#include <string>
#include <vector>

#include "runtime/solver/dynamics.h"
#include "runtime/solver/figures.h"

namespace rapid {

struct SolveOptions;

// Returns the stiff forces and actions, in the order of the chain, for the points before Solve. Changes nothing.
std::vector<Stiffness> find_stiff(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options);

// Merges `found` into `worst`, which keeps the stiffest result of each node.
void keep_worst(std::vector<Stiffness>& worst, const std::vector<Stiffness>& found);

// Returns a line such as
//
//   drag1: k dt = 16; treated exactly
//   drag1: k dt = 16; solved in closed form, with what else acts held through a sub-step
//   action "sun": omega dt = 1.9 at 1 sub-step; estimated error 0.2 m; 8 sub-steps would give 0.003 m
std::string text_of(const Stiffness& stiffness);

}  // namespace rapid
