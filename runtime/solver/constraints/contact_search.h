// All pairs of spheres that touch, from sparse grids of cells (paper §5.1, §5.2).
//
// Spheres of one size go into one grid, of cells as wide as they: a pair is then in one cell or in neighbours. Several
// sizes go into several grids (radius_grids.h); a pair of different grids is found from its smaller side.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/points/cell_grid.h"
#include "runtime/solver/constraints/radius_grids.h"

namespace rapid {

// Of each point the partners that come after it in the set, ascending: the same whatever the grids are.
struct Pairs {
    std::vector<std::uint32_t> begin;  // shape [points + 1]
    std::vector<std::uint32_t> other;

    std::size_t size() const { return other.size(); }
    std::span<const std::uint32_t> of(std::size_t i) const
    {
        return std::span(other).subspan(begin[i], begin[i + 1] - begin[i]);
    }
};

// What becomes of the pairs, for the error where there is no memory for them.
struct PairUse {
    std::string what = "the search for contacts";  // "radius = 3 m"
    std::string remedy = "give a smaller radius";
    double bytes_a_pair = 32;  // in all; the search itself takes that
};

// Pairs with |P_i - P_j| < reach_i + reach_j.
class ContactSearch {
public:
    // grids: of the radii, which the reaches may exceed; a reach is 0 for points in no grid. Error: more pairs than
    // there is memory for, before they are looked for.
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
    float blur_ = 0;  // m, by which distances in single precision may be off
    std::vector<CellGrid> grids_;
    CellSorter sorter_;
    std::vector<std::uint32_t> members_;        // of a grid
    std::vector<std::vector<Found>> found_;     // by grids and chunks of spheres; kept for their memory
    std::size_t used_ = 0;                      // of them
    Found pairs_;                               // by buckets of points
    std::vector<std::uint32_t> starts_, ends_;  // of these, by bucket and source
};

}  // namespace rapid
