// All pairs of spheres that touch, from sparse grids of cells (paper §5.1, §5.2).
//
// Spheres of one size go into one grid, of cells as wide as they: a pair is then in the same cell or in neighbours.
// Several sizes go into several grids, by the paper's Algorithm 1. A pair of different grids is found from its smaller
// side. Grids are cells sorted along x, y, z, with the spheres copied in that order: OpenVDB's point index grid answers
// the same questions 2 to 8 times slower. Empty space costs nothing in either.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/points/column.h"
#include "runtime/vec.h"

namespace rapid {

// Of each point the partners that come after it in the set, in their order: the same whatever the grids are.
struct Pairs {
    std::vector<std::uint32_t> begin;  // shape [points + 1]
    std::vector<std::uint32_t> other;

    std::size_t size() const { return other.size(); }
    std::span<const std::uint32_t> of(std::size_t i) const
    {
        return std::span(other).subspan(begin[i], begin[i + 1] - begin[i]);
    }
};

// The grids that points of these radii are put into: Algorithm 1.
class RadiusGrids {
public:
    // max_difference: m, of the radii in a grid. Points of no radius touch nothing, and are in no grid.
    RadiusGrids(Strided<float> radius, std::size_t size, double max_difference, int max_grids);

    struct Grid {
        double radius;  // m, the largest in it
        std::size_t points;
    };
    std::vector<Grid> grids;       // from coarse to fine
    std::vector<std::uint8_t> of;  // the grid of each point; empty where there is one grid at most and no point of no
                                   // radius
    static constexpr std::uint8_t none = 255;

    // How much larger the cells are than their spheres, m³ (paper, eq. 5): Σ s³ - 4/3 π r³, with s = 2 R; and as a part
    // of what cells cut to measure would be: Σ (s³ - (2r)³) / Σ (2r)³, which is 0 where all radii of a grid are equal.
    double error = 0, excess = 0;
};

// Pairs with |P_i - P_j| < reach_i + reach_j.
class ContactSearch {
public:
    // grids: of the radii, which the reaches may exceed; 0 for points in none.
    void find(std::span<const Vec3d> P, Strided<float> reach, const RadiusGrids& grids, Pairs& pairs);

private:
    struct Sphere {
        float x, y, z, r;
        std::uint32_t place, cell;
    };
    // Cells of one grid, with a border of empty ones, and the spheres in them in order of the cells.
    struct Cells {
        double width;
        std::int64_t least[3], count[3];   // cell coordinates
        std::size_t size;                  // spheres
        std::vector<std::uint32_t> place;  // in the set
        std::vector<float> x, y, z, r;     // from the middle of the scene, m; with room for a few lanes more
        std::vector<std::uint64_t> key;    // of the cells that are not empty
        std::vector<std::uint32_t> begin;  // of these; or of all where `dense`
        bool dense;

        std::uint64_t key_of(std::int64_t i, std::int64_t j, std::int64_t k) const
        {
            const auto at = [&](std::int64_t c, int axis) { return static_cast<std::uint64_t>(c - least[axis]); };
            return (at(k, 2) * static_cast<std::uint64_t>(count[1]) + at(j, 1)) * static_cast<std::uint64_t>(count[0]) +
                   at(i, 0);
        }
        void put(std::size_t m, const Sphere& sphere)
        {
            x[m] = sphere.x, y[m] = sphere.y, z[m] = sphere.z, r[m] = sphere.r;
            place[m] = sphere.place;
        }
        struct Run {
            std::uint32_t begin, end;
        };
        // The spheres in the cells of these keys, the last one included: part of a row.
        Run run(std::uint64_t first, std::uint64_t last) const;
        // In those from i0 to i1 of a row.
        Run row(std::int64_t i0, std::int64_t i1, std::int64_t j, std::int64_t k) const;
    };
    using Pair = std::pair<std::uint32_t, std::uint32_t>;
    using Found = std::vector<Pair>;

    void fill(Cells& cells, std::span<const Vec3d> P, Strided<float> reach, const RadiusGrids& grids, std::size_t g);
    template <class F>
    void sort_dense(Cells& cells, std::size_t all, const F& sphere);
    template <class F>
    void sort_sparse(Cells& cells, const F& sphere);
    std::vector<Found>& room_for(std::size_t spheres);
    void within(const Cells& cells, std::span<const Vec3d> P, Strided<float> reach);
    void between(const Cells& fine, const Cells& coarse, std::span<const Vec3d> P, Strided<float> reach);
    void list(Pairs& pairs, std::size_t points);

    Vec3d middle_;
    double blur_;  // m, by which positions in single precision may be off
    std::vector<Cells> cells_;
    std::vector<std::vector<Found>> found_;  // by grids and chunks of spheres; kept for their memory
    std::size_t used_ = 0;                   // of them
    std::vector<std::uint32_t> members_, order_;
    std::vector<std::uint64_t> keys_;
    // Sorted roughly: by buckets that fit a cache.
    std::vector<Sphere> spheres_;
    std::vector<Pair> pairs_;
    std::vector<std::uint32_t> starts_, ends_;  // by bucket and by where they come from
};

}  // namespace rapid
