// Finds all pairs of touching spheres with sparse cell grids (paper §5.1, §5.2).
//
// Spheres of one size share a grid whose cells are as wide as they are, so the two of a pair are in the same cell or
// in neighbouring cells. Several sizes use several grids (radius_grids.h); a pair from different grids is found from
// its smaller sphere.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/points/cell_grid.h"
#include "runtime/solver/constraints/radius_grids.h"

namespace rapid {

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
    double bytes_a_pair = 32;  // in total; the default is what the search itself takes
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
    std::size_t used_ = 0;                      // number of these in use
    Found pairs_;                               // by buckets of points
    std::vector<std::uint32_t> starts_, ends_;  // of these, by bucket and source
};

}  // namespace rapid
