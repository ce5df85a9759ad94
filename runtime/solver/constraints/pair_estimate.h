// Estimates the number of pairs of a grid search before it runs.
//
// In a grid, with n_c spheres in cell c, there are at most 27/2 Σ n_c² pairs, since a pair is in one cell or in two
// neighbouring ones. The estimate counts the neighbours of a few spheres: cells are chosen with probability n_c² / Σ
// n_c², a sphere of the cell has k neighbours, and the number of pairs is the mean of k / n_c, times Σ n_c² / 2. Pairs
// between a finer and a coarser grid are counted from evenly chosen spheres of the finer one.
#pragma once

#include <span>

#include "runtime/points/cell_grid.h"

namespace rapid {

// grids: from coarse to fine, none empty. Results do not depend on the number of threads.
double max_pairs(std::span<const CellGrid> grids);
double estimate_pairs(std::span<const CellGrid> grids, const SpheresView& spheres);

}  // namespace rapid
