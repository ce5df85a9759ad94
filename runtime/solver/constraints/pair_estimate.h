// How many pairs a search in grids of cells will find, told before it is made.
//
// In a grid, with n_c spheres in cell c, there are at most 27/2 Σ n_c² pairs, since a pair is in one cell or in two
// that are neighbours. For an estimate the neighbours of a few spheres are counted: cells are chosen with probability
// n_c² / Σ n_c², a sphere of the cell has k neighbours, and the mean of k / n_c, times Σ n_c² / 2, is the number of
// pairs. Spheres of a finer grid and a coarser one are counted from some of the finer grid, evenly chosen.
#pragma once

#include <span>

#include "runtime/points/cell_grid.h"

namespace rapid {

// grids: from coarse to fine, none of them empty. The same for any number of threads.
double most_pairs(std::span<const CellGrid> grids);
double estimate_pairs(std::span<const CellGrid> grids, const SpheresView& spheres);

}  // namespace rapid
