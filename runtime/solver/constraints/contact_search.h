// Finds all pairs of touching spheres with sparse cell grids (paper §5.1, §5.2).
//
// Spheres of one size share a grid whose cells are as wide as they are, so the two of a pair are in the same cell or
// in neighbouring cells. Several sizes use several grids (RadiusGrids); a pair from different grids is found from
// its smaller sphere.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/points/cell_grid.h"
#include "runtime/points/column.h"

namespace rapid {

// Assigns points to grids of cells by their radii (paper §5.2, Algorithm 1). Cells as wide as the largest sphere in
// them hold too many of the smallest, so several sizes use several grids.
class RadiusGrids {
public:
    // max_difference: m, between the radii in a grid; default: half of its largest radius. Points of radius 0 touch
    // nothing and are in no grid.
    RadiusGrids(Strided<float> radius, std::size_t size, std::optional<double> max_difference, int max_grids);

    struct Grid {
        double radius;  // m, the largest in it
        std::size_t points;
    };
    std::vector<Grid> grids;       // from coarse to fine
    std::vector<std::uint8_t> of;  // grid of each point; empty if there is at most one grid, with all points
    static constexpr std::uint8_t none = 255;

    // Excess volume of the cells over their spheres, m³ (paper, eq. 5): Σ s³ - 4/3 π r³, with s = 2 R; and relative to
    // cells of the exact size: Σ (s³ - (2r)³) / Σ (2r)³, which is 0 if all radii in each grid are equal.
    double error = 0, excess = 0;

private:
    void cluster(std::span<const float> descending, std::optional<double> max_difference, int max_grids,
                 std::vector<float>& least);
    void assign(Strided<float> radius, std::size_t size, std::span<const float> least);
    void measure(Strided<float> radius, std::size_t size);
};

// For each point, the partners with a higher index, ascending. The result does not depend on the grids.
struct Pairs {
    std::vector<std::uint32_t> begin;  // shape [points + 1]
    std::vector<std::uint32_t> other;

    std::size_t size() const { return other.size(); }
    std::span<const std::uint32_t> of(std::size_t i) const
    {
        return std::span(other).subspan(begin[i], begin[i + 1] - begin[i]);
    }
};

// The purpose of the pairs, for the error message if they do not fit in memory.
struct PairUse {
    std::string what = "the search for contacts";  // "radius = 3 m"
    std::string remedy = "give a smaller radius";
    double bytes_per_pair = 32;  // in total; the default is what the search itself takes
};

// Search for pairs with |P_i - P_j| < reach_i + reach_j.
class ContactSearch {
public:
    // grids: built from the radii, which the reaches may exceed. A reach is 0 for points in no grid. Throws Error,
    // before searching, if the pairs would exceed memory.
    void find(std::span<const Vec3d> P, Strided<float> reach, const RadiusGrids& grids, Pairs& pairs,
              const PairUse& use = {});

private:
    using Found = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

    void measure(std::span<const Vec3d> P, Strided<float> reach);
    void set_widths(const RadiusGrids& grids);
    void list_members(const RadiusGrids& grids, std::size_t grid);
    void require_room(const PairUse& use) const;
    std::vector<Found>& room_for(std::size_t spheres);
    void find_within(const CellGrid& grid);
    void find_between(const CellGrid& fine, const CellGrid& coarse);
    void sort(Pairs& pairs, std::size_t points);

    SpheresView spheres_{{}, {nullptr, 0}, Vec3d::Zero()};
    float blur_ = 0;  // m, error bound of distances in single precision
    std::vector<CellGrid> grids_;
    CellSorter sorter_;
    std::vector<std::uint32_t> members_;        // of a grid
    std::vector<std::vector<Found>> found_;     // by grids and chunks of spheres; keeps its memory for reuse
    std::size_t used_ = 0;                      // parts of found_ in use
    Found pairs_;                               // by buckets of points
    std::vector<std::uint32_t> starts_, ends_;  // of pairs_, by bucket and source
};

// Estimates the number of pairs of a grid search before it runs.
//
// In a grid, with n_c spheres in cell c, there are at most 27/2 Σ n_c² pairs, since a pair is in one cell or in two
// neighbouring ones. The estimate counts the neighbours of a few spheres: cells are chosen with probability n_c² / Σ
// n_c², a sphere of the cell has k neighbours, and the number of pairs is the mean of k / n_c, times Σ n_c² / 2. Pairs
// between a finer and a coarser grid are counted from evenly chosen spheres of the finer one.

// grids: from coarse to fine, none empty. Results do not depend on the number of threads.
double max_pairs(std::span<const CellGrid> grids);
double estimate_pairs(std::span<const CellGrid> grids, const SpheresView& spheres);

}  // namespace rapid
